// How a state moves an object on a plan: SVG transforms and outlines; degrees and metres.
const motions = (() => {
  const isTurn = (coordinate) => coordinate === "angle" || coordinate === "yaw";

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
    if (upper - lower >= 359.9) {
      return `M${x + r},${y}A${r},${r} 0 1 1 ${x - r},${y}A${r},${r} 0 1 1 ${x + r},${y}Z`;
    }
    const ends = [lower, upper].map((angle) => {
      const bearing = ((motion.bearing + motion.sense * angle) * Math.PI) / 180;
      return `${x + r * Math.cos(bearing)},${y + r * Math.sin(bearing)}`;
    });
    const large = upper - lower > 180 ? 1 : 0;
    return `M${x},${y}L${ends[0]}A${r},${r} 0 ${large} ${motion.sense > 0 ? 1 : 0} ${ends[1]}Z`;
  }

  function ghosts(motion, middle, lower, upper) {
    if (motion.kind === "slide") return [[lower[0]], [upper[0]]];
    return [
      [lower[0], middle[1], lower[2]], [upper[0], middle[1], upper[2]],
      [middle[0], lower[1], upper[2]], [middle[0], upper[1], lower[2]],
    ];
  }

  function home(object) {
    return object.coordinates.map((coordinate, k) =>
      isTurn(coordinate) ? (object.home[k] * 180) / Math.PI : object.home[k]);
  }

  return { isTurn, placed, sector, ghosts, home };
})();
