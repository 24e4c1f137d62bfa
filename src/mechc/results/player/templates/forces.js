// Forces as arrows: reactions in joints, and loads.  Each kind has a scale, which is told in words.
const FORCES = { arrows: "reactions", loads: "loads" };
const forcesShown = new Set(motion.forces || ["arrows"]);

function forcesOf(kind) { return motion[kind] || []; }
function metresPerNewton(kind, longest) {
  // Round, so that the usual force is nearly as long as this.
  const usual = forcesOf(kind).length ? forcesOf(kind)[0].usual : 0;
  return usual > 0 ? roundDown(longest / usual) : 0;
}
function wordsOfForces(length, longest) {
  return Object.keys(FORCES).filter(function (kind) {
    return forcesShown.has(kind) && metresPerNewton(kind, longest) > 0;
  }).map(function (kind) {
    return FORCES[kind] + ": " + threeDigits(length) + " m is " + threeDigits(length / metresPerNewton(kind, longest)) + " N";
  });
}
function threeDigits(value) { return String(Number(value.toPrecision(3))); }
