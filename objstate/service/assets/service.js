// A service: the plan as it is believed to be now, or was at a moment; robots, drives, uploads.
(() => {
  const $ = (id) => document.getElementById(id);
  const SVG = "http://www.w3.org/2000/svg";
  const CHUNK = 8 * 2 ** 20; // bytes of an upload that are sent at once
  const STALE_S = 3600; // seconds since an object was seen, from which on it is drawn paler
  const FADED_EVERY_MS = 10000; // beliefs fade without an event
  const ASKED_AFTER_MS = 80; // while the slider moves
  const STEPS = 1000;
  const NARROW = 0.9; // probability from which on a door counts as open or closed
  const { isTurn } = motions;

  let token = null, plan = null, words = new Map(), chosen = null, tag = null, drives = new Map();
  let first = null, at = null; // ns as BigInt; at: null is now
  const robots = new Map();

  // --- asking -------------------------------------------------------------------------

  class Refused extends Error {
    constructor(status, told) { super(told); this.status = status; }
  }

  async function ask(path, options = {}) {
    const headers = { Authorization: `Bearer ${token}`, ...options.headers };
    const answer = await fetch(path, { ...options, headers });
    if (answer.status === 304) return null;
    const content = answer.status === 204 ? null : await answer.json();
    if (!answer.ok) {
      throw new Refused(answer.status, `${content.detail || content.title} ${content.cure || ""}`.trim());
    }
    if (options.tagged) tag = answer.headers.get("ETag");
    return content;
  }

  function say(told, wrong = false) {
    $("said").textContent = told;
    $("said").classList.toggle("wrong", wrong);
  }

  const guarded = (work) => (...given) => Promise.resolve(work(...given)).catch((error) => say(error.message, true));

  // --- words --------------------------------------------------------------------------

  const degrees = (value) => (value * 180) / Math.PI;
  const shownAs = (coordinate, value) => (isTurn(coordinate) ? `${degrees(value).toFixed(1)}°` : `${value.toFixed(2)} m`);
  const nanoseconds = (date) => BigInt(date) * 1000000n;
  const date = (ns) => new Date(Number(ns / 1000000n));
  const moment = (ns) => date(ns).toLocaleString([], { dateStyle: "medium", timeStyle: "medium" });

  function ago(ns) {
    if (ns === null) return "never";
    const now = at === null ? nanoseconds(Date.now()) : at;
    const seconds = Number((now - BigInt(ns)) / 1000000000n);
    if (seconds < 90) return `${Math.max(seconds, 0)} s ago`;
    if (seconds < 5400) return `${Math.round(seconds / 60)} min ago`;
    if (seconds < 172800) return `${Math.round(seconds / 3600)} h ago`;
    return `${Math.round(seconds / 86400)} days ago`;
  }

  const closedOf = (object) => object.attributes?.closed?.true ?? null;

  function stateText(object) {
    const closed = closedOf(object);
    if (closed !== null && closed >= 0.5) return `closed ${Math.round(100 * closed)} %`;
    const states = Object.entries(object.state)
      .map(([name, each]) => (Object.keys(object.state).length > 1 ? `${name} ` : "") + shownAs(name, each.median));
    return closed === null ? states.join(", ") : `open ${Math.round(100 - 100 * closed)} %, ${states.join(", ")}`;
  }

  const intervalText = (object) => Object.entries(object.state)
    .map(([name, each]) => `${shownAs(name, each.lower)} to ${shownAs(name, each.upper)}`).join(", ");

  // --- the plan -----------------------------------------------------------------------

  function drawObject(object, index) {
    const said = words.get(object.name), group = plan.objects.get(index);
    if (!said) return;
    const inUnits = (key) => object.coordinates.map((name) =>
      (isTurn(name) ? degrees(said.state[name][key]) : said.state[name][key]));
    const median = inUnits("median"), lower = inUnits("lower"), upper = inUnits("upper");
    const seen = said.last_observed_ns;
    const now = at === null ? nanoseconds(Date.now()) : at;
    group.classList.toggle("unknown", seen === null);
    group.classList.toggle("stale", seen !== null && Number((now - BigInt(seen)) / 1000000000n) > STALE_S);
    group.classList.toggle("pointed", object.name === chosen);
    group.querySelector(".estimate").setAttribute("transform", motions.placed(object.motion, median));
    group.querySelector(".sector")?.setAttribute("d", motions.sector(object.motion, lower[0], upper[0]));
    const ghosts = [...group.querySelectorAll(".ghost")];
    const states = ghosts.length ? motions.ghosts(object.motion, median, lower, upper) : [];
    ghosts.forEach((ghost, k) => ghost.setAttribute("transform", motions.placed(object.motion, states[k])));
    group.querySelector(".true").style.display = "none";
    const name = plan.names.find((each) => each.index === index);
    name.text = name.reserve = object.name;
    name.node.classList.toggle("pointed", object.name === chosen);
    if (object.motion.kind === "free") { name.x = median[0]; name.y = -median[1]; }
  }

  function drawRobots() {
    const group = $("robots");
    const living = [...robots.values()].filter((each) => each.pose);
    while (group.children.length > living.length) group.lastChild.remove();
    while (group.children.length < living.length) {
      const each = document.createElementNS(SVG, "g"), mark = document.createElementNS(SVG, "path");
      const title = document.createElementNS(SVG, "title");
      each.setAttribute("class", "robot");
      mark.setAttribute("class", "mark");
      mark.setAttribute("d", "M9,0L-6,6L-3,0L-6,-6Z");
      each.append(title, mark);
      group.append(each);
    }
    living.forEach((robot, k) => {
      const each = group.children[k], [x, y, yaw] = robot.pose;
      each.setAttribute("transform", `translate(${x} ${y}) rotate(${degrees(yaw)})`);
      each.classList.toggle("lost", robot.lost);
      each.querySelector("title").textContent = robot.robot;
      each.querySelector(".mark").setAttribute("transform", `scale(${1 / plan.scale})`);
    });
    group.style.display = at === null ? "" : "none";
    const dots = living.flatMap((robot) => [...(robot.scans?.values() ?? [])].flat());
    $("scan").setAttribute("d", at === null ? dots.map(([x, y]) => `M${x},${y}h0`).join("") : "");
  }

  function draw() {
    plan.shapes.forEach(drawObject);
    drawRobots();
    drawTable();
    drawFacts();
    plan.placeNames();
  }

  // --- tables and facts -----------------------------------------------------------------

  function cell(row, told, className) {
    const each = document.createElement("td");
    each.textContent = told;
    if (className) each.className = className;
    row.append(each);
  }

  const rows = new Map();
  function drawTable() {
    const body = $("objects").tBodies[0];
    for (const { name } of plan.shapes) {
      const said = words.get(name);
      if (!said) continue;
      let row = rows.get(name);
      if (!row) {
        row = document.createElement("tr");
        row.tabIndex = 0;
        row.dataset.name = name;
        row.addEventListener("click", () => choose(name));
        row.addEventListener("keydown", (event) => {
          if (event.key === "Enter" || event.key === " ") { event.preventDefault(); choose(name); }
        });
        rows.set(name, row);
        body.append(row);
      }
      const head = document.createElement("th");
      head.scope = "row";
      head.textContent = name;
      row.replaceChildren(head);
      cell(row, stateText(said));
      cell(row, intervalText(said));
      cell(row, ago(said.last_observed_ns));
      row.classList.toggle("pointed", name === chosen);
      row.setAttribute("aria-selected", name === chosen);
    }
  }

  function fact(name, number, told) {
    const figure = document.createElement("b");
    figure.textContent = number;
    $(`fact-${name}`).replaceChildren(figure, told);
  }

  function drawFacts() {
    const doors = [...words.values()].map(closedOf).filter((each) => each !== null);
    const closed = doors.filter((each) => each >= NARROW).length;
    const open = doors.filter((each) => each <= 1 - NARROW).length;
    fact("open", open, "doors open");
    fact("closed", closed, "doors closed");
    fact("unsure", doors.length - open - closed, "doors uncertain");
    fact("robots", [...robots.values()].filter((each) => each.drive).length, "robots driving");
    const waiting = [...drives.values()].filter((each) => ["waiting", "running"].includes(each.state)).length;
    fact("drives", `${drives.size}`, waiting ? `drives, ${waiting} not done` : "drives");
  }

  function drawDrives() {
    const listed = [...drives.values()].sort((a, b) => b.received_ns - a.received_ns).slice(0, 50);
    $("drives").tBodies[0].replaceChildren(...listed.map((drive) => {
      const row = document.createElement("tr"), head = document.createElement("th");
      head.scope = "row";
      head.textContent = drive.id;
      row.append(head);
      cell(row, drive.robot || "–");
      cell(row, moment(BigInt(drive.received_ns)));
      const running = drive.state === "running" ? `running, ${Math.round(100 * drive.progress)} %` : drive.state;
      if (drive.reason && drive.state === "failed") cell(row, `failed: ${drive.reason}`, "failed");
      else cell(row, running);
      return row;
    }));
  }

  function drawRobotList() {
    const shown = [...robots.values()].map((robot) => {
      const each = document.createElement("article");
      each.classList.toggle("lost", Boolean(robot.lost));
      const told = robot.drive ? `${robot.lost ? "lost; " : ""}${robot.state || "driving"}` : robot.connection;
      each.textContent = [`${robot.robot}: ${told}`, ...(robot.warnings ?? [])].join(". ");
      return each;
    });
    if (!shown.length) {
      const none = document.createElement("p");
      none.textContent = "None sends. `objstate serve --foxglove NAME=ws://…` connects to one.";
      shown.push(none);
    }
    $("robot-list").replaceChildren(...shown);
  }

  // --- the chosen object -----------------------------------------------------------------

  function part(name, given = {}, ...inner) {
    const each = Object.assign(document.createElement(name), given);
    each.append(...inner);
    return each;
  }

  const choose = guarded(async (name) => {
    chosen = name === chosen ? null : name;
    $("chosen").hidden = chosen === null;
    draw();
    if (chosen !== null) await drawChosen();
  });

  async function drawChosen() {
    const name = chosen, said = words.get(name), box = $("chosen");
    const close = part("button", { type: "button", textContent: "close", ariaLabel: "close" });
    close.addEventListener("click", () => choose(name));
    const state = part("p", { id: "chosen-state", textContent: `${stateText(said)} (${intervalText(said)})` });
    const seen = part("p", { textContent: `last seen: ${ago(said.last_observed_ns)}${said.predicted ? ", predicted since" : ""}` });
    const parts = [part("h2", {}, part("span", { textContent: name }), close), state, seen];
    if (said.kind !== "planar") parts.push(passageRow(name), evidenceRow(name));
    const [past, reports] = await Promise.all([
      ask(`/v1/objects/${encodeURIComponent(name)}/history`),
      ask(`/v1/objects/${encodeURIComponent(name)}/evidence`),
    ]);
    if (name !== chosen) return;
    parts.push(historyStrip(past.history));
    if (reports.evidence.length) {
      parts.push(part("ul", {}, ...reports.evidence.slice(-5).reverse().map((each) => part("li", {
        textContent: `${each.source}, ${moment(BigInt(each.stamp_ns))}: ${shownAs(Object.keys(said.state)[0], each.lower)} to ${shownAs(Object.keys(said.state)[0], each.upper)}`,
      }))));
    }
    box.replaceChildren(...parts);
  }

  function passageRow(name) {
    const width = part("input", { type: "number", step: "0.05", min: "0.05", value: "0.60", ariaLabel: "width of the robot, m" });
    const length = part("input", { type: "number", step: "0.05", min: "0", value: "0.90", ariaLabel: "length of the robot, m" });
    const told = part("output", { id: "passage" });
    const answer = guarded(async () => {
      const when = at === null ? "" : `&at=${at}`;
      const found = await ask(`/v1/objects/${encodeURIComponent(name)}/passage?width=${+width.value}&length=${+length.value}${when}`);
      told.textContent = `passes with probability ${found.probability.toFixed(2)}`;
    });
    width.addEventListener("change", answer);
    length.addEventListener("change", answer);
    answer();
    return part("div", { className: "row" }, part("label", {}, "width, m", width), part("label", {}, "length, m", length), told);
  }

  function evidenceRow(name) {
    const report = (state) => guarded(async () => {
      const body = JSON.stringify({ source: "a person at the page", state });
      await ask(`/v1/objects/${encodeURIComponent(name)}/evidence`, { method: "POST", body });
      say(`${name} is ${state}: noted.`);
      await load();
      await drawChosen();
    });
    const buttons = ["open", "closed"].map((state) => {
      const each = part("button", { type: "button", textContent: `it is ${state}` });
      each.addEventListener("click", report(state));
      return each;
    });
    return part("div", { className: "row" }, "I see it:", ...buttons);
  }

  // Means and 90 % intervals of what was learnt, over time.
  function historyStrip(past) {
    const svg = document.createElementNS(SVG, "svg");
    svg.setAttribute("class", "history");
    svg.setAttribute("viewBox", "0 0 1000 100");
    svg.setAttribute("preserveAspectRatio", "none");
    svg.setAttribute("role", "img");
    svg.setAttribute("aria-label", `${past.length} moments at which something was learnt`);
    if (!past.length) return part("p", { textContent: "Nothing was learnt of it yet." });
    const name = Object.keys(past[0].state)[0];
    const stamps = past.map((each) => Number(BigInt(each.stamp_ns) / 1000000n));
    const begin = stamps[0], span = Math.max(stamps.at(-1) - begin, 1);
    const values = past.flatMap((each) => [each.state[name].lower, each.state[name].upper]);
    const low = Math.min(...values), high = Math.max(...values, low + 1e-3);
    const x = (k) => 10 + (980 * (stamps[k] - begin)) / span;
    const y = (value) => 95 - (90 * (value - low)) / (high - low);
    let spans = "", medians = "";
    past.forEach((each, k) => {
      const { lower, upper, median } = each.state[name];
      spans += `M${x(k)},${y(lower)}V${y(upper)}`;
      medians += `M${x(k)},${y(median)}h0.01`;
    });
    for (const [kind, d] of [["span", spans], ["median", medians]]) {
      const path = document.createElementNS(SVG, "path");
      path.setAttribute("class", kind);
      path.setAttribute("d", d);
      svg.append(path);
    }
    const caption = part("p", {
      textContent: `${name}: ${shownAs(name, low)} to ${shownAs(name, high)}, ${moment(BigInt(past[0].stamp_ns))} to ${moment(BigInt(past.at(-1).stamp_ns))}`,
    });
    return part("div", {}, svg, caption);
  }

  // --- what to look at next ----------------------------------------------------------------

  const drawNext = guarded(async () => {
    const robot = [...robots.values()].find((each) => each.pose);
    const box = $("next");
    if (!robot) {
      box.replaceChildren(part("p", { textContent: "Shown for the first robot that drives." }));
      return;
    }
    const pose = robot.pose.map((each) => each.toFixed(3)).join(",");
    const found = await ask(`/v1/next?pose=${encodeURIComponent(pose)}`);
    const required = found.tasks.map((each) => part("article", {},
      part("b", { textContent: `${each.object}: ` }), each.why));
    const useful = found.actions.filter((each) => each.utility > 0).slice(0, 3).map((each) => part("article", {},
      part("b", { textContent: `${each.object}: ` }),
      `${each.gain.toFixed(2)} nats expected, ${each.distance.toFixed(1)} m away`));
    const shown = [...required, ...useful];
    const wait = found.next_worthwhile_in_s;
    const later = wait ? ` The next look is worth it in about ${Math.ceil(wait / 60)} min.` : "";
    box.replaceChildren(
      part("p", { textContent: `For ${robot.robot}:` }),
      ...(shown.length ? shown : [part("p", { textContent: `Nothing is worth a look now.${later}` })]));
  });

  // --- loading and following ---------------------------------------------------------------

  async function load() {
    const when = at === null ? "" : `?at=${at}`;
    const headers = at === null && tag ? { "If-None-Match": tag } : {};
    const found = await ask(`/v1/objects${when}`, { headers, tagged: at === null });
    if (found) words = new Map(found.objects.map((each) => [each.object, each]));
    draw();
  }

  async function loadDrives() {
    const found = await ask("/v1/drives");
    drives = new Map(found.drives.map((each) => [each.id, each]));
    drawDrives();
    drawFacts();
    const { taken } = await ask("/v1/watched");
    $("aside").replaceChildren(...taken.filter((each) => each.reason).map((each) =>
      part("li", { textContent: `${each.address} was set aside: ${each.reason}` })));
  }

  async function loadRobots() {
    const found = await ask("/v1/robots");
    const known = new Set(found.robots.map((each) => each.robot));
    [...robots.keys()].filter((name) => !known.has(name)).forEach((name) => robots.delete(name));
    for (const each of found.robots) robots.set(each.robot, { ...robots.get(each.robot), ...each });
    drawRobotList();
    drawRobots();
    drawFacts();
  }

  const happened = {
    belief(data) {
      const known = words.get(data.object);
      if (at !== null || data.last_observed_ns < known?.last_observed_ns) return; // of a late report
      words.set(data.object, { ...known, ...data, predicted: false });
      tag = null;
      scheduleDraw();
    },
    robot(data) {
      const robot = robots.get(data.robot) ?? { robot: data.robot };
      robot.scans ??= new Map();
      robot.scans.set(data.laser, data.points);
      robots.set(data.robot, Object.assign(robot, { pose: data.pose, lost: data.lost, drive: data.drive }));
      if (plan) drawRobots();
    },
    state(data) {
      robots.set(data.robot, { ...robots.get(data.robot), ...data });
      drawRobotList();
    },
    lost(data) { say(`${data.robot} is lost.`, true); },
    found(data) { say(`${data.robot} knows where it is again.`); },
    drive(data) {
      drives.set(data.id, data);
      drawDrives();
      if (data.robot) guarded(loadRobots)();
      if (data.state === "done" || data.state === "failed") guarded(load)();
    },
    deleted() { tag = null; guarded(load)(); guarded(loadDrives)(); },
  };

  let drawing = null;
  function scheduleDraw() {
    drawing ??= requestAnimationFrame(() => { drawing = null; draw(); });
  }

  // Server-Sent Events by fetch, which can send a token.
  async function follow() {
    let last = null;
    for (;;) {
      try {
        const headers = { Authorization: `Bearer ${token}`, ...(last ? { "Last-Event-ID": last } : {}) };
        const answer = await fetch("/v1/stream", { headers });
        if (!answer.ok) throw new Error(`the stream was refused (${answer.status})`);
        document.documentElement.dataset.connected = "yes";
        const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
        let kept = "";
        for (;;) {
          const { value, done } = await reader.read();
          if (done) break;
          const pieces = (kept + value).split("\n\n");
          kept = pieces.pop();
          for (const piece of pieces) {
            const fields = Object.fromEntries(piece.split("\n").map((line) => {
              const colon = line.indexOf(":");
              return [line.slice(0, colon), line.slice(colon + 1).trim()];
            }));
            if (fields.id) last = fields.id;
            if (fields.event && happened[fields.event]) happened[fields.event](JSON.parse(fields.data));
          }
        }
      } catch (error) {
        say(`Not connected: ${error.message}. Trying again.`, true);
      }
      document.documentElement.dataset.connected = "no";
      await new Promise((done) => setTimeout(done, 2000));
    }
  }

  // --- time -----------------------------------------------------------------------------

  let asking = null;
  function go(position) {
    const slider = $("time"), now = nanoseconds(Date.now());
    slider.value = Math.max(0, Math.min(STEPS, position));
    const isNow = +slider.value >= STEPS || first === null;
    at = isNow ? null : first + ((now - first) * BigInt(slider.value)) / BigInt(STEPS);
    $("clock").textContent = isNow ? "now" : moment(at);
    slider.setAttribute("aria-valuetext", $("clock").textContent);
    $("now").setAttribute("aria-pressed", isNow);
    tag = null;
    clearTimeout(asking);
    asking = setTimeout(guarded(load), ASKED_AFTER_MS);
  }

  // --- uploads ----------------------------------------------------------------------------

  const send = guarded(async (file) => {
    const told = part("progress", { max: file.size, value: 0 }), line = part("li", {}, told, file.name);
    $("uploads").append(line);
    try {
      let upload = await ask("/v1/uploads", { method: "POST", body: JSON.stringify({ size: file.size }) });
      const { id } = upload;
      while (upload.offset < file.size) {
        const chunk = file.slice(upload.offset, upload.offset + CHUNK);
        const headers = { "Upload-Offset": `${upload.offset}` };
        const answer = await ask(`/v1/uploads/${id}`, { method: "PATCH", body: chunk, headers });
        upload = answer.offset === undefined ? { offset: file.size } : answer;
        told.value = upload.offset;
      }
      line.append(" – came, waits to be estimated");
    } catch (error) {
      line.append(` – ${error.message}`);
      throw error;
    }
    await loadDrives();
  });

  // --- beginning --------------------------------------------------------------------------

  async function begin() {
    const found = await ask("/v1/plan");
    sessionStorage.setItem("token", token);
    $("login").hidden = true;
    $("shown").hidden = false;
    document.querySelector("h1").textContent = found.building;
    document.title = `${found.building} – objstate`;
    $("viewport").insertAdjacentHTML("afterbegin", found.svg);
    plan = plans.watch($("plan"));
    plan.shapes = found.objects;
    plan.told = (index) => {
      const { name } = plan.shapes[index], said = words.get(name);
      return said ? [name, stateText(said), intervalText(said), `last seen ${ago(said.last_observed_ns)}`] : [name];
    };
    plan.chosen = (index) => choose(plan.shapes[index].name);
    plan.moved = drawRobots;
    first = found.first_ns === null ? null : BigInt(found.first_ns) - 1000000000n; // before anything was learnt
    say("");
    await Promise.all([load(), loadDrives(), loadRobots()]);
    drawNext();
    follow();
    setInterval(guarded(async () => { if (at === null) await load(); }), FADED_EVERY_MS);
    setInterval(() => { guarded(loadRobots)(); drawNext(); }, FADED_EVERY_MS);
  }

  async function open(secret) {
    token = secret;
    try {
      await begin();
    } catch (error) {
      token = null;
      sessionStorage.removeItem("token");
      $("login").hidden = false;
      $("shown").hidden = true;
      say(error.message, true);
      $("token").focus();
    }
  }

  $("login").addEventListener("submit", (event) => { event.preventDefault(); open($("token").value.trim()); });
  $("time").addEventListener("input", () => go(+$("time").value));
  $("now").addEventListener("click", () => go(STEPS));
  $("filter").addEventListener("input", () => {
    const sought = $("filter").value.trim().toLowerCase();
    rows.forEach((row, name) => { row.hidden = !row.textContent.toLowerCase().includes(sought); });
    plan.shapes.forEach(({ name }, index) => plan.objects.get(index).classList.toggle("filtered", rows.get(name)?.hidden ?? false));
  });
  $("files").addEventListener("change", () => { [...$("files").files].forEach(send); $("files").value = ""; });
  for (const kind of ["dragover", "dragleave", "drop"]) {
    document.addEventListener(kind, (event) => {
      event.preventDefault();
      $("drop").classList.toggle("over", kind === "dragover");
      if (kind === "drop") [...event.dataTransfer.files].forEach(send);
    });
  }
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !plan || event.target.matches("input, select, textarea")) return;
    const shown = [...rows.values()].filter((row) => !row.hidden);
    const index = shown.findIndex((row) => row.dataset.name === chosen);
    const keys = {
      "/": () => $("filter").focus(),
      ArrowLeft: () => go(+$("time").value - 5),
      ArrowRight: () => go(+$("time").value + 5),
      End: () => go(STEPS),
      ArrowDown: () => shown.length && choose(shown[(index + 1) % shown.length].dataset.name),
      ArrowUp: () => shown.length && choose(shown[(index - 1 + shown.length) % shown.length].dataset.name),
      "+": () => plan.zoom(1.5),
      "=": () => plan.zoom(1.5),
      "-": () => plan.zoom(1 / 1.5),
      "0": () => plan.fit(),
    };
    if (!keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  });

  const given = /^#token=([\w-]+)$/.exec(location.hash);
  if (given) history.replaceState(null, "", location.pathname);
  const known = given ? given[1] : sessionStorage.getItem("token");
  if (known) open(known);
  else $("login").hidden = false;
})();
