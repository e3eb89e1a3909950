// Plans: moving, zooming, and names that don't cover one another.
const plans = new Map(); // by their SVG
const tip = (() => {
  const box = document.createElement("div");
  box.className = "tip";
  box.hidden = true;
  document.body.append(box);
  return {
    show(lines, x, y) {
      box.replaceChildren(...lines.map((line) => {
        const each = document.createElement("div");
        each.textContent = line;
        return each;
      }));
      box.hidden = false;
      const size = box.getBoundingClientRect();
      box.style.left = `${Math.max(4, Math.min(x + 14, innerWidth - size.width - 8))}px`;
      box.style.top = `${y + size.height + 24 > innerHeight ? y - size.height - 12 : y + 16}px`;
    },
    hide() { box.hidden = true; },
  };
})();

(() => {
  const CLOSEST = 80, FARTHEST = 0.5; // how much larger or smaller than fitting a plan may be
  const STEP = 1.5; // of the buttons
  const DRAG = 4; // px, from where on a press is no click
  const LINE = 15; // px, height of a name
  const DISTANCES = [7, 16, 28, 44, 64, 90]; // px of a name from its object
  const CROWDED = 0.16; // the share of a plan that names may cover
  const LEADER = 20; // px, from where on a line leads to the name
  const SIDES = [[0, 1], [0, -1], [1, 0], [-1, 0], [1, 1], [-1, 1], [1, -1], [-1, -1]];
  const SVG = "http://www.w3.org/2000/svg";
  const ruler = document.createElement("canvas").getContext("2d");

  class Plan {
    constructor(svg) {
      const { x, y, width, height } = svg.viewBox.baseVal;
      this.svg = svg;
      this.home = { x, y, width, height };
      this.box = { ...this.home };
      this.moved = () => {};
      this.names = [...svg.querySelectorAll("text.name")].map((node) => ({
        node, index: +node.dataset.object, text: node.textContent, reserve: node.textContent,
        x: node.x.baseVal[0].value, y: node.y.baseVal[0].value,
      }));
      this.objects = new Map(
        [...svg.querySelectorAll("g.object")].map((each) => [+each.dataset.object, each]));
      this.leaders = document.createElementNS(SVG, "path");
      this.leaders.setAttribute("class", "leader");
      svg.querySelector(".names").prepend(this.leaders);
      this.pointers = new Map();
      this.listen();
      this.fit();
    }

    get scale() { return this.svg.clientWidth / this.box.width; } // px per metre
    get zoomed() { return this.box.width < 0.98 * this.whole().width; }

    // What shows all of the plan, in the shape of the window.
    whole() {
      const { x, y, width, height } = this.home;
      const shape = this.svg.clientWidth / Math.max(this.svg.clientHeight, 1);
      const w = Math.max(width, height * shape), h = w / shape;
      return { x: x - (w - width) / 2, y: y - (h - height) / 2, width: w, height: h };
    }

    fit() { this.show(this.whole()); }

    show(box) {
      this.box = box;
      this.svg.setAttribute("viewBox", `${box.x} ${box.y} ${box.width} ${box.height}`);
      this.svg.style.setProperty("--metre-per-px", 1 / this.scale);
      this.svg.classList.toggle("zoomed", this.zoomed);
      this.moved();
      this.placeNames();
    }

    // Larger or smaller by a factor, a point (in px of the window) staying where it is.
    zoom(factor, px, py) {
      const whole = this.whole();
      const width = Math.min(whole.width / FARTHEST, Math.max(whole.width / CLOSEST, this.box.width / factor));
      const f = width / this.box.width;
      const u = px === undefined ? 0.5 : px / this.svg.clientWidth;
      const v = py === undefined ? 0.5 : py / this.svg.clientHeight;
      this.show({
        x: this.box.x + u * this.box.width * (1 - f), y: this.box.y + v * this.box.height * (1 - f),
        width, height: this.box.height * f,
      });
    }

    pan(dx, dy) { // px
      const s = this.scale;
      this.show({ ...this.box, x: this.box.x - dx / s, y: this.box.y - dy / s });
    }

    // Bring a place into the middle if it is near the edge, or outside.
    reveal(x, y) {
      const { box } = this, u = (x - box.x) / box.width, v = (y - box.y) / box.height;
      if (u > 0.2 && u < 0.8 && v > 0.2 && v < 0.8) return;
      this.show({ ...box, x: x - box.width / 2, y: y - box.height / 2 });
    }

    resized() {
      const { x, y, width, height } = this.box;
      const shape = this.svg.clientWidth / Math.max(this.svg.clientHeight, 1);
      if (!this.zoomed || !width) { this.fit(); return; }
      this.show({ x, y: y + height / 2 - width / shape / 2, width, height: width / shape });
    }

    listen() {
      const { svg, pointers } = this;
      let travelled = 0;
      svg.addEventListener("wheel", (event) => {
        if (!event.ctrlKey && !event.metaKey) return;
        event.preventDefault();
        const at = svg.getBoundingClientRect();
        this.zoom(Math.exp(-event.deltaY / 200), event.clientX - at.left, event.clientY - at.top);
      }, { passive: false });
      svg.addEventListener("pointerdown", (event) => {
        if (event.button) return;
        pointers.set(event.pointerId, [event.clientX, event.clientY]);
        travelled = 0;
      });
      svg.addEventListener("pointermove", (event) => {
        const before = pointers.get(event.pointerId);
        if (!before) return;
        const dx = event.clientX - before[0], dy = event.clientY - before[1];
        travelled += Math.hypot(dx, dy);
        if (pointers.size === 2) this.pinch(event);
        else if (travelled > DRAG && (event.pointerType === "mouse" || this.zoomed)) {
          svg.setPointerCapture(event.pointerId);
          svg.classList.add("dragged");
          this.dragged?.();
          this.pan(dx, dy);
        }
        pointers.set(event.pointerId, [event.clientX, event.clientY]);
      });
      const end = (event) => {
        pointers.delete(event.pointerId);
        svg.classList.remove("dragged");
      };
      svg.addEventListener("pointerup", end);
      svg.addEventListener("pointercancel", end);
      svg.addEventListener("click", (event) => {
        const object = event.target.closest("g.object, text.name");
        if (travelled <= DRAG && object) this.chosen?.(+object.dataset.object);
      });
      svg.addEventListener("dblclick", (event) => {
        const at = svg.getBoundingClientRect();
        this.zoom(2, event.clientX - at.left, event.clientY - at.top);
      });
      svg.addEventListener("pointerover", (event) => {
        const object = event.target.closest("g.object, text.name");
        if (!object) return;
        const index = +object.dataset.object;
        tip.show(this.told(index), event.clientX, event.clientY);
        this.pointed?.(index);
      });
      svg.addEventListener("pointerout", () => { tip.hide(); this.pointed?.(null); });
      const stage = svg.closest(".stage");
      stage.querySelector(".larger").addEventListener("click", () => this.zoom(STEP));
      stage.querySelector(".smaller").addEventListener("click", () => this.zoom(1 / STEP));
      stage.querySelector(".fit").addEventListener("click", () => this.fit());
    }

    pinch(event) {
      const [other] = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const before = this.pointers.get(event.pointerId);
      const apart = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]);
      const at = this.svg.getBoundingClientRect();
      this.zoom(apart([event.clientX, event.clientY]) / Math.max(apart(before), 1),
        (event.clientX + other[0]) / 2 - at.left, (event.clientY + other[1]) / 2 - at.top);
    }

    told(index) { return [this.names.find((name) => name.index === index).text]; }

    // --- names ----------------------------------------------------------------------

    // Names stand where they cover neither one another nor an object; those that find no place are
    // left out, and told when somebody points at the object.
    placeNames() {
      cancelAnimationFrame(this.placing);
      this.placing = requestAnimationFrame(() => this.placeNow());
    }

    placeNow() {
      const s = this.scale, { box, svg } = this;
      const style = getComputedStyle(svg), corner = svg.getBoundingClientRect();
      ruler.font = `600 12px ${style.fontFamily}`;
      const wide = svg.clientWidth, tall = svg.clientHeight;
      const things = new Map([...this.objects].map(([index, group]) => {
        const part = group.querySelector(".leaf") || group;
        const r = part.getBoundingClientRect();
        return [index, [r.left - corner.left, r.top - corner.top, r.right - corner.left, r.bottom - corner.top]];
      }));
      const placed = [];
      let hidden = 0, lines = "", covered = 0;
      const overlap = (a, b) => Math.max(0, Math.min(a[2], b[2]) - Math.max(a[0], b[0])) *
        Math.max(0, Math.min(a[3], b[3]) - Math.max(a[1], b[1]));
      const isWrong = (name) => name.node.classList.contains("wrong");
      const ordered = [...this.names].sort((a, b) => isWrong(b) - isWrong(a));
      for (const name of ordered) {
        const x = (name.x - box.x) * s, y = (name.y - box.y) * s;
        const w = ruler.measureText(name.reserve).width + 8;
        const own = things.get(name.index);
        let best = null;
        const consider = (cx, cy, distance) => {
          const at = [cx - w / 2, cy - LINE / 2, cx + w / 2, cy + LINE / 2];
          const out = at[0] < 0 || at[1] < 0 || at[2] > wide || at[3] > tall;
          if (out || placed.some((other) => overlap(at, other) > 0)) return;
          let cost = distance;
          for (const [index, thing] of things) {
            const hit = overlap(at, thing);
            if (hit && (index !== name.index || distance > 0)) cost += 8 + hit / 20;
          }
          if (!best || cost < best.cost) best = { cost, at, cx, cy, distance };
        };
        if (x < 0 || y < 0 || x > wide || y > tall) { name.node.classList.add("crowded"); continue; }
        const isFull = covered + w * LINE > CROWDED * wide * tall;
        if (isFull) { name.node.classList.add("crowded"); hidden += 1; continue; }
        if (own && own[2] - own[0] > w && own[3] - own[1] > LINE) consider(x, y, 0);
        for (const d of DISTANCES) {
          if (best && best.cost <= d) break;
          for (const [dx, dy] of SIDES) {
            const k = dx && dy ? Math.SQRT1_2 : 1;
            consider(x + dx * (d * k + w / 2), y + dy * (d * k + LINE / 2), d);
          }
        }
        name.node.classList.toggle("crowded", !best);
        if (!best) { hidden += 1; continue; }
        placed.push(best.at);
        covered += w * LINE;
        name.node.setAttribute("x", box.x + best.cx / s);
        name.node.setAttribute("y", box.y + best.cy / s);
        if (best.distance > LEADER) {
          const ex = Math.min(Math.max(x, best.at[0]), best.at[2]);
          const ey = Math.min(Math.max(y, best.at[1]), best.at[3]);
          lines += `M${name.x},${name.y}L${box.x + ex / s},${box.y + ey / s}`;
        }
      }
      this.leaders.setAttribute("d", lines);
      const told = this.svg.parentElement.querySelector("#hidden");
      if (told) told.textContent = hidden ? `${hidden} more ${hidden > 1 ? "names" : "name"}: zoom in, or point at objects` : "";
    }
  }

  plans.watch = (svg) => {
    plans.set(svg, new Plan(svg));
    return plans.get(svg);
  };
  document.querySelectorAll("svg.plan").forEach(plans.watch);
  addEventListener("resize", () => plans.forEach((plan) => plan.resized()));
  addEventListener("beforeprint", () => {
    document.querySelectorAll(".warnings").forEach((told) => { told.open = true; });
  });
})();
