// Doors: dragged, flipped, added, accepted and rejected; each change is saved at once.
(() => {
  const SNAP = 12; // px, within which a hinge or a free edge goes to a wall's end, or line
  const NUDGE = 0.01; // m, of the arrow keys
  const NARROWEST = 0.2, UPPER = 90; // m, and degrees that a new door opens
  const MOST_STEPS = 500; // that can be undone
  const SVG = "http://www.w3.org/2000/svg";
  const data = JSON.parse(document.getElementById("data").textContent);
  const at = (id) => document.getElementById(id);
  const svg = at("plan"), layer = at("doors"), plan = plans.get(svg);
  const rad = (degrees) => degrees * Math.PI / 180;
  const deg = (radians) => radians * 180 / Math.PI;
  const round = (value, digits) => Number(value.toFixed(digits));
  const wrapped = (degrees) => round(((degrees + 180) % 360 + 360) % 360 - 180, 3);

  let doors = data.doors, chosen = doors.length ? 0 : -1, angle = 0;
  let undone = [], done = [], clicks = null, dragging = null;

  // --- state --------------------------------------------------------------------------

  const snapshot = () => JSON.stringify({ doors, chosen });

  // Change the doors by a function; what was before can be had again.
  function change(act) {
    const before = snapshot();
    act();
    if (snapshot() !== before) keep(before);
    show();
  }

  function keep(before) {
    done.push(before);
    if (done.length > MOST_STEPS) done.shift();
    undone = [];
    save();
  }

  function travel(from, to) {
    if (!from.length) return;
    to.push(snapshot());
    ({ doors, chosen } = JSON.parse(from.pop()));
    show();
    save();
  }

  const here = () => doors[chosen];
  const slides = (door) => door.sense === 0;
  const opens = (door) => slides(door) ? "slides" : door.sense > 0 ? "ccw" : "cw";
  const beyond = (door, way) => { // along the closed leaf, from its hinge
    const bearing = rad(door.bearing);
    return [door.x + way * Math.cos(bearing), door.y + way * Math.sin(bearing)];
  };
  // Ends of the leaf, open by degrees, or by metres if it slides.
  const leafAt = (door, open) => {
    if (slides(door)) return [beyond(door, -open), beyond(door, door.width - open)];
    return [[door.x, door.y], beyond({ ...door, bearing: door.bearing + door.sense * open }, door.width)];
  };
  const freeEdge = (door) => beyond(door, door.width);

  function setFreeEdge(door, [x, y]) {
    const width = Math.hypot(x - door.x, y - door.y);
    if (width < NARROWEST) return;
    door.width = round(width, 4);
    door.bearing = wrapped(deg(Math.atan2(y - door.y, x - door.x)));
  }

  function unusedName() {
    const taken = new Set([...data.names, ...doors.map((door) => door.name)]);
    for (let k = 1; ; k += 1) {
      const name = `door_${String(k).padStart(2, "0")}`;
      if (!taken.has(name)) return name;
    }
  }

  const decide = (decision) => chosen >= 0 && change(() => { here().decision = decision; });
  const edit = (act) => chosen >= 0 && change(() => {
    act(here());
    here().decision = "accepted";
  });
  const flip = () => edit((door) => {
    [door.x, door.y] = freeEdge(door).map((value) => round(value, 4));
    door.bearing = wrapped(door.bearing + 180);
    setSense(door, -door.sense); // it opens to the same side as before
  });
  const turn = () => here() && slides(here()) ? flip() : edit((door) => setSense(door, -door.sense));
  const slide = () => edit((door) => setSense(door, slides(door) ? 1 : 0));

  function setSense(door, sense) { // 0 slides
    const was = slides(door);
    door.sense = sense || 0;
    door.in_map = null; // the map's leaf opened the other way
    if (slides(door) !== was) door.upper = was ? UPPER : door.width;
  }

  const nudge = (x, y) => edit((door) => {
    door.x = round(door.x + x, 4);
    door.y = round(door.y + y, 4);
  });

  function choose(index, reveal) {
    chosen = index;
    angle = 0;
    show();
    if (reveal && here()) plan.reveal(here().x, -here().y);
  }

  function step(by) {
    const listed = visible();
    if (!listed.length) return;
    const place = listed.indexOf(chosen);
    choose(listed[(place + by + listed.length) % listed.length], true);
  }

  const visible = () => {
    const wanted = at("search").value.trim().toLowerCase();
    return doors.map((_, index) => index)
      .filter((index) => doors[index].name.toLowerCase().includes(wanted));
  };

  // --- saving -------------------------------------------------------------------------

  function say(text, wrong) {
    at("said").textContent = text;
    at("said").classList.toggle("wrong", Boolean(wrong));
  }

  let saving = null, again = false;
  async function save() {
    if (!data.token) { say("not saved: download the table"); return; }
    if (saving) { again = true; return; }
    saving = true;
    say("saving …");
    try {
      const answer = await fetch("save", {
        method: "POST", body: JSON.stringify({ doors }),
        headers: {
          "Content-Type": "application/json", "X-Objstate-Token": data.token,
          "X-Objstate-Revision": data.revision,
        },
      });
      const told = await answer.json();
      if (told.saved) { data.revision = told.revision; say("saved"); } else say(told.error, true);
    } catch { say("not saved: the server is gone", true); }
    saving = null;
    if (again) { again = false; save(); }
  }

  const isTaken = (door) =>
    door.decision === "open" ? (door.probability ?? 0) >= 0.5 : door.decision !== "rejected";
  const quoted = (name) => /[",\n]/.test(name) ? `"${name.replaceAll('"', '""')}"` : name;

  function table() {
    const columns = {
      door: (door) => quoted(door.name), hinge_x: (door) => door.x, hinge_y: (door) => door.y,
      closed_bearing_deg: (door) => door.bearing, opens, width_m: (door) => door.width,
      upper_limit_deg: (door) => slides(door) ? "" : door.upper,
      upper_limit_m: (door) => slides(door) ? door.upper : "", in_map_deg: (door) => door.in_map ?? "",
    };
    const taken = doors.filter(isTaken), optional = ["upper_limit_m", "in_map_deg"];
    const names = Object.keys(columns).filter(
      (name) => !optional.includes(name) || taken.some((door) => columns[name](door) !== ""),
    );
    const rows = taken.map((door) => names.map((name) => columns[name](door)).join(","));
    return [names.join(","), ...rows, ""].join("\n");
  }

  function download() {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([table()], { type: "text/csv" }));
    link.download = "doors.csv";
    link.click();
    URL.revokeObjectURL(link.href);
    if (!data.token) say("downloaded");
  }

  // --- drawing ------------------------------------------------------------------------

  const path = (group, d, kind) => {
    const made = document.createElementNS(SVG, "path");
    made.setAttribute("d", d);
    made.setAttribute("class", kind);
    group.append(made);
    return made;
  };
  const point = ([x, y]) => `${x.toFixed(3)},${y.toFixed(3)}`;

  function drawDoor(door, index) {
    const group = document.createElementNS(SVG, "g");
    const turned = index === chosen ? Math.min(angle, door.upper) : 0;
    group.setAttribute("class", `object door ${door.decision}${index === chosen ? " chosen" : ""}`);
    group.dataset.object = index;
    const hinge = [door.x, door.y], edge = freeEdge(door);
    if (slides(door)) path(group, `M${point(hinge)}L${point(leafAt(door, door.upper)[0])}`, "ahead");
    else {
      const r = door.width.toFixed(3), large = door.upper > 180 ? 1 : 0, sweep = door.sense > 0 ? 1 : 0;
      const wide = point(leafAt(door, door.upper)[1]);
      path(group, `M${point(hinge)}L${point(edge)}A${r},${r} 0 ${large} ${sweep} ${wide}Z`, "sector");
    }
    if (turned) path(group, `M${point(hinge)}L${point(edge)}`, "ahead");
    path(group, `M${leafAt(door, turned).map(point).join("L")}`, "shown leaf");
    path(group, `M${point(hinge)}L${point(edge)}`, "hit");
    path(group, `M${point(hinge)}h0`, "hinge");
    path(group, `M${point(edge)}h0`, "end");
    path(group, `M${point(hinge)}h0`, "grip").dataset.grip = "hinge";
    path(group, `M${point(edge)}h0`, "grip").dataset.grip = "end";
    layer.append(group);
    const name = document.createElementNS(SVG, "text");
    name.setAttribute("class", "name");
    name.dataset.object = index;
    name.textContent = door.name;
    svg.querySelector(".names").append(name);
    const middle = [(hinge[0] + edge[0]) / 2, (hinge[1] + edge[1]) / 2];
    return { index, group, name: {
      node: name, index, text: door.name, reserve: door.name, x: middle[0], y: -middle[1],
    } };
  }

  function show() {
    layer.replaceChildren();
    svg.querySelectorAll(".names text").forEach((each) => each.remove());
    const drawn = doors.map(drawDoor);
    plan.objects = new Map(drawn.map(({ index, group }) => [index, group]));
    plan.names = drawn.map(({ name }) => name);
    plan.placeNames();
    showForm();
    showList();
    at("undo").disabled = !done.length;
    at("redo").disabled = !undone.length;
    at("add").setAttribute("aria-pressed", Boolean(clicks));
    svg.classList.toggle("adding", Boolean(clicks));
  }

  function showForm() {
    const door = here();
    for (const key of ["name", "x", "y", "bearing", "width", "upper", "sense"]) {
      const field = at(`in-${key}`);
      field.disabled = !door;
      if (field !== document.activeElement) field.value = door ? door[key] : "";
    }
    for (const id of ["accept", "reject", "flip", "turn", "slide", "in-angle"]) at(id).disabled = !door;
    const metres = door && slides(door);
    at("in-angle").max = door ? door.upper : 90;
    at("in-angle").step = metres ? 0.01 : 1;
    at("in-angle").value = angle;
    at("angle").textContent = metres ? angle.toFixed(2) : Math.round(angle);
  }

  function showList() {
    const cell = (row, text, kind = "td") => {
      const made = document.createElement(kind);
      made.textContent = text;
      row.append(made);
    };
    at("rows").replaceChildren(...visible().map((index) => {
      const door = doors[index], row = document.createElement("tr");
      row.dataset.index = index;
      row.className = `${door.decision}${index === chosen ? " chosen" : ""}`;
      cell(row, door.name, "th");
      cell(row, door.probability === null ? "" : door.probability.toFixed(2));
      cell(row, door.decision);
      cell(row, door.width.toFixed(2));
      cell(row, opens(door));
      return row;
    }));
  }

  // --- pointing -----------------------------------------------------------------------

  function place(event) { // m, in the building
    const map = layer.getScreenCTM().inverse();
    const seen = new DOMPoint(event.clientX, event.clientY).matrixTransform(map);
    return [seen.x, seen.y];
  }

  // The nearest end of a wall, else the nearest place on one, if it is near on the screen.
  function snapped([x, y], event) {
    if (event.altKey) return [x, y];
    const reach = SNAP / plan.scale;
    let end = null, line = null;
    for (const [ax, ay, bx, by] of data.walls) {
      for (const [px, py] of [[ax, ay], [bx, by]]) {
        const far = Math.hypot(px - x, py - y);
        if (far < reach && (!end || far < end.far)) end = { far, at: [px, py] };
      }
      const square = (bx - ax) ** 2 + (by - ay) ** 2;
      if (!square) continue;
      const share = Math.min(1, Math.max(0, ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / square));
      const foot = [ax + share * (bx - ax), ay + share * (by - ay)];
      const far = Math.hypot(foot[0] - x, foot[1] - y);
      if (far < reach && (!line || far < line.far)) line = { far, at: foot };
    }
    return (end || line || { at: [x, y] }).at;
  }

  layer.addEventListener("pointerdown", (event) => {
    const grip = event.target.dataset.grip;
    if (!grip || event.button || clicks) return;
    event.stopPropagation(); // the plan stays
    event.preventDefault();
    const index = +event.target.closest(".door").dataset.object;
    dragging = { grip, before: snapshot(), edge: freeEdge(doors[index]) };
    chosen = index;
    angle = 0;
    show();
  });
  addEventListener("pointermove", (event) => {
    if (clicks) { sketch(event); return; }
    if (!dragging) return;
    const to = snapped(place(event), event), door = here();
    if (dragging.grip === "end") setFreeEdge(door, to);
    else { // the leaf goes along with its hinge
      door.x = round(to[0], 4);
      door.y = round(to[1], 4);
    }
    door.decision = "accepted";
    show();
  });
  addEventListener("pointerup", () => {
    if (!dragging) return;
    const { before } = dragging;
    dragging = null;
    const now = JSON.parse(snapshot()).doors, was = JSON.parse(before).doors;
    if (JSON.stringify(now) !== JSON.stringify(was)) keep(before);
    show();
  });

  const opening = ([hx, hy], [ex, ey], [x, y]) => (ex - hx) * (y - hy) - (ey - hy) * (x - hx) > 0 ? 1 : -1;

  function sketch(event) {
    const to = clicks.length < 2 ? snapped(place(event), event) : place(event);
    const corners = clicks.length < 2 ? [...clicks, to] : [clicks[1], clicks[0], to];
    at("drawing").setAttribute("d", `M${corners.map(point).join("L")}`);
  }

  function startAdding() {
    clicks = clicks ? null : [];
    at("drawing").setAttribute("d", "");
    say(clicks ? "click the hinge, the free edge of the closed leaf, and where it opens to" : "");
    show();
  }

  svg.addEventListener("click", (event) => {
    if (!clicks) return;
    event.stopImmediatePropagation();
    const to = place(event);
    if (clicks.length < 2) {
      const end = snapped(to, event);
      if (!clicks.length || Math.hypot(end[0] - clicks[0][0], end[1] - clicks[0][1]) >= NARROWEST) {
        clicks.push(end);
      }
      return;
    }
    const [hinge, edge] = clicks, sense = opening(hinge, edge, to);
    clicks = null;
    at("drawing").setAttribute("d", "");
    change(() => {
      const door = {
        name: unusedName(), x: round(hinge[0], 4), y: round(hinge[1], 4), bearing: 0, width: 1,
        upper: UPPER, sense, decision: "accepted", probability: null, in_map: null,
        found_at: null,
      };
      setFreeEdge(door, edge);
      doors.push(door);
      chosen = doors.length - 1;
    });
  }, true);

  plan.chosen = (index) => choose(index, false);

  // --- the form, the list and the keys ------------------------------------------------

  // What the door table accepts, in the unit that the page shows.
  const numbers = {
    x: [-1e8, 1e8, "m"], y: [-1e8, 1e8, "m"], bearing: [-1e4, 1e4, "degrees"],
    width: [NARROWEST, 5, "m"], upper: [7, 359, "degrees"],
  };
  const TRAVEL = [0.05, 10, "m"]; // of leaves that slide
  for (const [key, range] of Object.entries(numbers)) {
    at(`in-${key}`).addEventListener("change", (event) => {
      const typed = event.target.value, value = Number(typed);
      const [low, high, unit] = key === "upper" && here() && slides(here()) ? TRAVEL : range;
      event.target.blur();
      if (!typed || !(value >= low && value <= high)) {
        const label = event.target.parentElement.firstChild.textContent;
        say(`not changed: '${label}' must be ${low} to ${high} ${unit}${typed && `, not ${typed}`}`, true);
        show();
        return;
      }
      edit((door) => { door[key] = key === "bearing" ? wrapped(value) : round(value, 4); });
    });
  }
  at("in-name").addEventListener("change", (event) => {
    const name = event.target.value.trim();
    event.target.blur();
    const isTaken = data.names.includes(name) || doors.some((door, k) => k !== chosen && door.name === name);
    if (!name || isTaken) { say(name ? `'${name}' is the name of another` : "a door needs a name", true); show(); return; }
    edit((door) => { door.name = name; });
  });
  at("in-sense").addEventListener("change", (event) => {
    const sense = Number(event.target.value);
    event.target.blur();
    edit((door) => setSense(door, sense));
  });
  at("in-angle").addEventListener("input", (event) => { angle = Number(event.target.value); show(); });
  at("form").addEventListener("submit", (event) => event.preventDefault());
  at("rows").addEventListener("click", (event) => {
    const row = event.target.closest("tr");
    if (row) choose(+row.dataset.index, true);
  });
  at("search").addEventListener("input", showList);

  const acts = {
    accept: () => decide("accepted"), reject: () => decide("rejected"), flip, turn, slide, add: startAdding,
    undo: () => travel(done, undone), redo: () => travel(undone, done), download,
    points: () => svg.classList.toggle("plain"),
  };
  for (const [id, act] of Object.entries(acts)) at(id).addEventListener("click", act);

  const keys = {
    j: () => step(1), k: () => step(-1), y: () => { decide("accepted"); }, n: () => { decide("rejected"); },
    f: flip, d: turn, s: slide, a: startAdding, u: acts.undo, r: () => at("in-name").select(),
    ArrowLeft: () => nudge(-NUDGE, 0), ArrowRight: () => nudge(NUDGE, 0),
    ArrowUp: () => nudge(0, NUDGE), ArrowDown: () => nudge(0, -NUDGE),
    Escape: () => { if (clicks) startAdding(); },
    "/": () => at("search").focus(), "+": () => plan.zoom(1.5), "-": () => plan.zoom(1 / 1.5), 0: () => plan.fit(),
  };
  addEventListener("keydown", (event) => {
    const typing = event.target.matches("input:not([type=range]), select");
    if (typing) { if (event.key === "Escape") event.target.blur(); return; }
    if (event.ctrlKey || event.metaKey) {
      const key = event.key.toLowerCase();
      if (key !== "z" && key !== "y") return;
      event.preventDefault();
      if (key === "y" || event.shiftKey) acts.redo(); else acts.undo();
      return;
    }
    const act = keys[event.key];
    if (!act || event.altKey) return;
    event.preventDefault();
    act();
  });

  show();
})();
