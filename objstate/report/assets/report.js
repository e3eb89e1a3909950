"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const plan = document.getElementById("plan");
  const viewport = document.getElementById("viewport");
  const slider = document.getElementById("time");
  const clock = document.getElementById("clock");
  const play = document.getElementById("play");
  const shapes = [...plan.querySelectorAll("g.object")];
  const names = [...plan.querySelectorAll("text.name")];
  const readouts = new Map(
    [...document.querySelectorAll("article output")].map((each) => [+each.dataset.object, each]),
  );
  const cursors = [...document.querySelectorAll(".cursor")];
  const FRESH = 30; // tenths of a second since the last estimate while a scan is near
  const SHOWN_IN = 20; // seconds that it takes to play a whole log
  const isTurn = (coordinate) => coordinate === "angle" || coordinate === "yaw";

  // The index of the last moment at or before t, or -1.
  function lastAt(times, t) {
    let low = 0, high = times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] <= t) low = middle + 1; else high = middle;
    }
    return low - 1;
  }

  // From the page's units (tenths of a degree, millimetres) to degrees and metres.
  const scaled = (coordinate, value) => (isTurn(coordinate) ? value / 10 : value / 1000);

  function placed(motion, state) {
    if (motion.kind === "turn") {
      return `rotate(${motion.sense * state[0]} ${motion.pivot[0]} ${motion.pivot[1]})`;
    }
    if (motion.kind === "slide") {
      return `translate(${state[0] * motion.along[0]} ${state[0] * motion.along[1]})`;
    }
    if (motion.kind === "free") return `translate(${state[0]} ${state[1]}) rotate(${state[2]})`;
    return "";
  }

  // A sector from the lower to the upper angle, seen from above.
  function sector(motion, lower, upper) {
    const [x, y] = motion.pivot, r = 1.15 * motion.reach;
    const ends = [lower, upper].map((angle) => {
      const bearing = ((motion.bearing + motion.sense * angle) * Math.PI) / 180;
      return `${x + r * Math.cos(bearing)},${y + r * Math.sin(bearing)}`;
    });
    if (upper - lower >= 359.9) return "";
    const large = upper - lower > 180 ? 1 : 0;
    return `M${x},${y}L${ends[0]}A${r},${r} 0 ${large} ${motion.sense > 0 ? 1 : 0} ${ends[1]}Z`;
  }

  function ghostStates(motion, mean, lower, upper) {
    if (motion.kind === "slide") return [lower, upper];
    return [
      [lower[0], mean[1], lower[2]], [upper[0], mean[1], upper[2]],
      [mean[0], lower[1], upper[2]], [mean[0], upper[1], lower[2]],
    ];
  }

  function homeState(object) {
    return object.coordinates.map((coordinate, k) =>
      isTurn(coordinate) ? (object.home[k] * 180) / Math.PI : object.home[k]);
  }

  function trueState(object, t) {
    const state = object.coordinates.map((coordinate) => {
      const course = object.truth[coordinate];
      const index = course ? lastAt(course.t, t) : -1;
      return index < 0 ? null : scaled(coordinate, course.v[index]);
    });
    return state.includes(null) ? null : state;
  }

  function drawObject(object, index, t) {
    const group = shapes[index], at = lastAt(object.t, t);
    const values = (column) => object.coordinates.map(
      (coordinate, k) => scaled(coordinate, object[column][k][at]));
    const mean = at < 0 ? homeState(object) : values("mean");
    group.classList.toggle("unknown", at < 0);
    group.classList.toggle("held", at >= 0 && t - object.t[at] > FRESH);
    group.querySelector(".estimate").setAttribute("transform", placed(object.motion, mean));
    if (object.motion.kind === "free") {
      names[index].setAttribute("x", mean[0]);
      names[index].setAttribute("y", -mean[1]);
    }
    const spread = group.querySelector(".sector"), ghosts = [...group.querySelectorAll(".ghost")];
    if (at >= 0) {
      const lower = values("lower"), upper = values("upper");
      if (spread) spread.setAttribute("d", sector(object.motion, lower[0], upper[0]));
      const states = ghosts.length ? ghostStates(object.motion, mean, lower, upper) : [];
      ghosts.forEach((ghost, k) => ghost.setAttribute("transform", placed(object.motion, [].concat(states[k]))));
    }
    if (spread && at < 0) spread.setAttribute("d", "");
    ghosts.forEach((ghost) => { ghost.style.display = at < 0 ? "none" : ""; });
    const real = group.querySelector(".true"), truth = trueState(object, t);
    real.style.display = truth ? "" : "none";
    if (truth) real.setAttribute("transform", placed(object.motion, truth));
    const readout = readouts.get(index);
    if (readout) readout.textContent = at < 0 ? "not near yet" : told(object, at, t, mean, values);
  }

  function told(object, at, t, mean, values) {
    const lower = values("lower"), upper = values("upper");
    const parts = object.coordinates.map((coordinate, k) => {
      const turn = isTurn(coordinate), digits = turn ? 1 : 2, unit = turn ? "°" : " m";
      const label = object.coordinates.length > 1 ? `${coordinate} ` : "";
      return `${label}${mean[k].toFixed(digits)}${unit} ` +
        `(${lower[k].toFixed(digits)} to ${upper[k].toFixed(digits)})`;
    });
    let seen = at;
    while (seen >= 0 && !object.seen[seen]) seen -= 1;
    const ago = seen < 0 ? "not seen yet" : `seen ${Math.round((t - object.t[seen]) / 10)} s ago`;
    return `${parts.join(", ")}, ${ago}`;
  }

  function drawRobot(t) {
    const robot = data.robot, at = lastAt(robot.t, t);
    const marker = document.getElementById("robot"), driven = document.getElementById("driven");
    marker.style.display = at < 0 ? "none" : "";
    if (at < 0) { driven.setAttribute("d", ""); return; }
    marker.setAttribute("transform",
      `translate(${robot.x[at] / 100} ${robot.y[at] / 100}) rotate(${robot.yaw[at]})`);
    let way = "";
    for (let k = 0; k <= at; k += 1) way += `${k ? "L" : "M"}${robot.x[k] / 100},${robot.y[k] / 100}`;
    driven.setAttribute("d", way);
    follow(robot.x[at] / 100, -robot.y[at] / 100);
  }

  function draw() {
    const t = +slider.value;
    clock.textContent = `${(t / 10).toFixed(1)} s`;
    const share = `${Math.min(100, (10 * t) / Math.max(data.duration, 0.1))}%`;
    cursors.forEach((cursor) => { cursor.style.left = share; });
    data.objects.forEach((object, index) => drawObject(object, index, t));
    drawRobot(t);
  }

  // --- the size of the plan ---------------------------------------------------------

  let zoom = 1;
  function resize() {
    const least = parseFloat(getComputedStyle(plan).minWidth) || 0;
    plan.style.width = `${Math.max(viewport.clientWidth, least) * zoom}px`;
    sizeNames();
  }
  function follow(x, y) {
    const box = plan.viewBox.baseVal, scale = plan.clientWidth / box.width;
    viewport.scrollLeft = (x - box.x) * scale - viewport.clientWidth / 2;
    viewport.scrollTop = (y - box.y) * scale - viewport.clientHeight / 2;
  }
  function zoomBy(factor) {
    zoom = Math.min(16, Math.max(1, zoom * factor));
    resize();
    draw();
  }

  // --- what people do ---------------------------------------------------------------

  function show(t) {
    slider.value = Math.round(t);
    draw();
  }
  let playing = null;
  function stop() {
    cancelAnimationFrame(playing);
    playing = null;
    play.textContent = "play";
  }
  play.addEventListener("click", () => {
    if (playing !== null) { stop(); return; }
    if (+slider.value >= +slider.max) slider.value = 0;
    const from = +slider.value, begun = performance.now();
    play.textContent = "stop";
    const step = (now) => {
      const t = from + ((now - begun) / 1000) * (slider.max / SHOWN_IN);
      show(Math.min(t, +slider.max));
      if (t < +slider.max) playing = requestAnimationFrame(step); else stop();
    };
    playing = requestAnimationFrame(step);
  });
  slider.addEventListener("input", draw);
  document.querySelectorAll(".map").forEach((map) => map.addEventListener("click", (event) => {
    const box = map.getBoundingClientRect();
    show(((event.clientX - box.left) / box.width) * data.duration * 10);
  }));
  document.getElementById("larger").addEventListener("click", () => zoomBy(1.5));
  document.getElementById("smaller").addEventListener("click", () => zoomBy(1 / 1.5));
  addEventListener("resize", () => { resize(); draw(); });

  const asked = /^#t=([\d.]+)$/.exec(location.hash);
  resize();
  show(asked ? 10 * asked[1] : slider.max);
})();
