// Figures as SVG files that stand alone.
(() => {
  const SVG = "http://www.w3.org/2000/svg";
  const KEPT = [
    "fill", "fill-opacity", "fill-rule", "stroke", "stroke-width", "stroke-opacity", "stroke-dasharray",
    "stroke-linecap", "stroke-linejoin", "opacity", "vector-effect", "paint-order", "font-size",
    "font-family", "font-weight", "text-anchor", "dominant-baseline", "image-rendering",
  ];
  const paper = () => getComputedStyle(document.documentElement).getPropertyValue("--card").trim();

  // A copy with what the style sheet says written into it.
  function copied(node) {
    const style = getComputedStyle(node);
    if (style.display === "none" || style.visibility === "hidden") return null;
    const copy = node.cloneNode(false);
    copy.removeAttribute("class");
    copy.removeAttribute("style");
    [...copy.attributes].filter((each) => each.name.startsWith("data-"))
      .forEach((each) => copy.removeAttribute(each.name));
    if (node.tagName === "image") copy.setAttribute("style", "image-rendering: pixelated");
    if (!["title", "defs", "svg", "image"].includes(node.tagName)) {
      KEPT.forEach((name) => {
        const value = style.getPropertyValue(name);
        if (value && value !== "none" || name === "fill") copy.setAttribute(name, value);
      });
      if (node.style.strokeOpacity) copy.setAttribute("stroke-opacity", style.strokeOpacity);
    }
    for (const child of node.childNodes) {
      const inner = child.nodeType === Node.ELEMENT_NODE
        ? (child.tagName === "title" ? child.cloneNode(true) : copied(child)) : child.cloneNode();
      if (inner) copy.append(inner);
    }
    return copy;
  }

  function made(name, attributes, text) {
    const node = document.createElementNS(SVG, name);
    Object.entries(attributes).forEach(([key, value]) => node.setAttribute(key, value));
    if (text !== undefined) node.textContent = text;
    return node;
  }

  function sheet(width, height) {
    const root = made("svg", { width, height, viewBox: `0 0 ${width} ${height}` });
    root.append(made("rect", { width, height, fill: paper() }));
    return root;
  }

  function written(node, root, origin) {
    const style = getComputedStyle(node), at = node.getBoundingClientRect();
    if (!at.width || !node.textContent.trim()) return;
    root.append(made("text", {
      x: at.left - origin.left, y: at.top - origin.top + 0.8 * at.height, fill: style.color,
      "font-size": style.fontSize, "font-family": style.fontFamily, "font-weight": style.fontWeight,
    }, node.textContent));
  }

  // Whatever a figure holds, where it stands on the page: drawings as they are, words as text.
  function standalone(figure) {
    const origin = figure.getBoundingClientRect();
    const root = sheet(Math.ceil(origin.width), Math.ceil(origin.height));
    figure.querySelectorAll("svg").forEach((svg) => {
      const at = svg.getBoundingClientRect(), inner = copied(svg);
      if (!inner || !at.width) return;
      inner.setAttribute("x", at.left - origin.left);
      inner.setAttribute("y", at.top - origin.top);
      inner.setAttribute("width", at.width);
      inner.setAttribute("height", at.height);
      root.append(inner);
    });
    figure.querySelectorAll(".lost, .moved").forEach((shade) => {
      if (shade.tagName !== "B") return;
      const at = shade.getBoundingClientRect();
      root.append(made("rect", {
        x: at.left - origin.left, y: at.top - origin.top, width: at.width, height: at.height,
        fill: getComputedStyle(shade).color, "fill-opacity": 0.25,
      }));
    });
    const words = "h3 > span, h3 output, .values span, .times span, figcaption";
    figure.querySelectorAll(words).forEach((node) => written(node, root, origin));
    return root;
  }

  document.querySelectorAll(".figure").forEach((figure) => {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "export";
    button.textContent = "SVG";
    button.title = "save this figure as an SVG file";
    button.addEventListener("click", () => {
      const text = new XMLSerializer().serializeToString(standalone(figure));
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([text], { type: "image/svg+xml" }));
      link.download = `${figure.dataset.name.replace(/[^\w.-]+/g, "_")}.svg`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    });
    figure.append(button);
  });
})();
