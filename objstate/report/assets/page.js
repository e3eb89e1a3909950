"use strict";
document.getElementById("theme").addEventListener("click", () => {
  const root = document.documentElement;
  const dark = root.dataset.theme
    ? root.dataset.theme === "dark"
    : matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = dark ? "light" : "dark";
});

// Names on a plan are as large on the screen at any scale: the style sheet sizes them in metres.
function sizeNames() {
  document.querySelectorAll(".plan").forEach((plan) => {
    plan.style.setProperty("--metre-per-px", plan.viewBox.baseVal.width / plan.clientWidth);
  });
}
addEventListener("resize", sizeNames);
sizeNames();
