"use strict";
// Light and dark, printing, and tables that can be sorted and filtered.
document.getElementById("theme").addEventListener("click", () => {
  const root = document.documentElement;
  const dark = root.dataset.theme
    ? root.dataset.theme === "dark"
    : matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = dark ? "light" : "dark";
});
document.getElementById("print").addEventListener("click", () => print());

(() => {
  const LEAST_ROWS = 8; // fewer are found without a filter
  const names = new Intl.Collator("en", { numeric: true, sensitivity: "base" });

  function valueOf(cell) {
    const told = cell.dataset.value === undefined ? cell.textContent : cell.dataset.value;
    const number = parseFloat(told.replace(/(\d)[, ](?=\d{3})/g, "$1"));
    return Number.isNaN(number) || /^[^\d.+-]/.test(told.trim()) ? told : number;
  }

  // Numbers before words, words as people expect them, nothing at all last.
  function compared(a, b) {
    const kinds = [a, b].map((value) => (typeof value === "number" ? 0 : /^–?$/.test(value) ? 2 : 1));
    if (kinds[0] !== kinds[1]) return kinds[0] - kinds[1];
    return kinds[0] === 0 ? a - b : names.compare(a, b);
  }

  function sort(table, column, direction) {
    const body = table.tBodies[0];
    const rows = [...body.rows].map((row) => [valueOf(row.cells[column]), row]);
    rows.sort((a, b) => {
      const empty = compared(a[0], b[0]);
      const last = [a[0], b[0]].some((value) => value === "–" || value === "");
      return last ? empty : direction * empty;
    });
    body.append(...rows.map((row) => row[1]));
    [...table.tHead.rows[0].cells].forEach((head, k) => {
      if (k === column) head.setAttribute("aria-sort", direction > 0 ? "ascending" : "descending");
      else head.removeAttribute("aria-sort");
    });
  }

  document.querySelectorAll("table.sortable").forEach((table) => {
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = head.textContent;
      button.addEventListener("click", () => {
        sort(table, column, head.getAttribute("aria-sort") === "ascending" ? -1 : 1);
      });
      head.replaceChildren(button);
    });
  });

  document.querySelectorAll("table.filterable").forEach((table) => {
    const states = table.classList.contains("states");
    if (table.tBodies[0].rows.length < LEAST_ROWS) return;
    const field = document.createElement("input");
    field.type = "search";
    field.className = "filter";
    field.placeholder = "filter";
    field.setAttribute("aria-label", "show rows that contain");
    field.addEventListener("input", () => {
      const sought = field.value.trim().toLowerCase();
      for (const row of table.tBodies[0].rows) {
        row.hidden = !row.textContent.toLowerCase().includes(sought);
      }
      if (states) document.dispatchEvent(new CustomEvent("filtered", { detail: sought }));
    });
    table.parentElement.before(field);
  });
})();
