// The camera: orbit, pan and zoom, preset views, a fit to the motion, one that follows a body.
const FIELD = 32 * Math.PI / 180;
const camera = new THREE.PerspectiveCamera(32, 1, 1, 10);
let orbit = null, followed = -1, homeView = "isometric", flight = null;
const VIEWS = {
  front: [0, 0, 1], back: [0, 0, -1], top: [0, 1, 1e-4], side: [1, 0, 0], isometric: [0.62, 0.5, 0.9]
};
const centre = new THREE.Vector3(), lastCentre = new THREE.Vector3();

function startCamera(canvas) {
  orbit = new THREE.OrbitControls(camera, canvas);
  orbit.enableDamping = false;
  orbit.screenSpacePanning = true;
  orbit.addEventListener("change", redraw);
  orbit.addEventListener("start", function () { flight = null; });
  homeView = motion.flat ? "front" : "isometric";
  const box = runBox();
  followed = box.size > 6 * bodySize() ? 0 : -1;
}
function followCentre(at, out) {
  // 0: the middle of all points; k: the middle of link k - 1.
  out.set(0, 0, 0);
  const points = followed === 0 ? motion.points.map(function (_, i) { return i; }) : motion.links[followed - 1].points;
  points.forEach(function (point) { out.add(place(point, at, spare)); });
  out.divideScalar(points.length || 1);
  return world.localToWorld(out);
}
const spare = new THREE.Vector3();
function followTo(at) {
  if (followed < 0) { return; }
  followCentre(at, centre);
  spare.subVectors(centre, lastCentre);
  lastCentre.copy(centre);
  camera.position.add(spare);
  orbit.target.add(spare);
  if (flight) { flight.from.add(spare); flight.to.add(spare); flight.target.add(spare); flight.origin.add(spare); }
  orbit.update();
}
function follow(choice, at) {
  followed = choice;
  if (choice < 0) { return; }
  followCentre(at, lastCentre);
  spare.subVectors(lastCentre, orbit.target);
  camera.position.add(spare);
  orbit.target.copy(lastCentre);
  orbit.update();
}

// -- what has to be seen ----------------------------------------------------------------------
function seenPoints(at) {
  // Some hundred frames of the run; relative to the followed body where there is one.
  const frames = Math.max(1, Math.floor(motion.frames / 120)), list = [], shift = new THREE.Vector3();
  for (let f = 0; f < motion.frames; f += frames) {
    if (followed >= 0) { followCentre(f, shift).sub(followCentre(at, spare2)); }
    eachBody(f, function (position, support) { list.push({ p: position.clone().sub(shift), support: support }); });
  }
  return list.length ? list : [{ p: new THREE.Vector3(), support: pointSupport }];
}
function pointSupport() { return 1.6 * unit; }
function eachBody(f, use) {
  // Points and solids in world coordinates, with how far they reach in a direction.
  const position = new THREE.Vector3();
  for (let k = 0; k < pointCount; k += 1) { use(world.localToWorld(place(k, f, position)), pointSupport); }
  motion.solids.forEach(function (solid, k) {
    const turn = new THREE.Quaternion();
    placeSolid(k, f, position, turn);
    turn.premultiply(world.quaternion);
    use(world.localToWorld(position), function (direction) { return supportOf(solid, turn, direction); });
  });
}
const spare2 = new THREE.Vector3();
function runBox() {
  const box = new THREE.Box3();
  for (let i = 0; i < tracks.length; i += 3) { box.expandByPoint(spare.set(tracks[i], tracks[i + 1], tracks[i + 2])); }
  if (box.isEmpty()) { box.expandByPoint(spare.set(0, 0, 0)); }
  return { box: box, size: box.getSize(spare).length() };
}
function bodySize() {
  const box = new THREE.Box3();
  for (let k = 0; k < pointCount; k += 1) { box.expandByPoint(place(k, 0, spare)); }
  return Math.max(2 * reach, box.isEmpty() ? 1 : box.getSize(spare).length() || 60 * unit);
}
function fitFor(direction, at) {
  // The nearest position in a direction from which all that moves is within the picture.
  const out = direction.clone().normalize(), right = new THREE.Vector3(), up = new THREE.Vector3();
  right.crossVectors(UP, out).normalize();
  up.crossVectors(out, right);
  const points = seenPoints(at);
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  points.forEach(function (item) {
    item.at = [right, up, out].map(function (axis) { return item.p.dot(axis); });
    item.size = [right, up, out].map(item.support);
    item.at.forEach(function (x, k) {
      low[k] = Math.min(low[k], x - item.size[k]); high[k] = Math.max(high[k], x + item.size[k]);
    });
  });
  const mid = low.map(function (x, k) { return (x + high[k]) / 2; });
  const half = Math.tan(FIELD / 2), wide = 0.92 * half * camera.aspect, over = toolbarShares();
  const tall = 0.92 * half * (1 - over.top - over.bottom);
  let distance = 4 * unit;
  points.forEach(function (item) {
    const x = Math.abs(item.at[0] - mid[0]) + item.size[0], y = Math.abs(item.at[1] - mid[1]) + item.size[1];
    distance = Math.max(distance, item.at[2] - mid[2] + item.size[2] + Math.max(x / wide, y / tall));
  });
  const target = right.multiplyScalar(mid[0]).addScaledVector(up, mid[1]).addScaledVector(out, mid[2]);
  target.addScaledVector(up, (over.top - over.bottom) * half * distance);
  return { target: target, position: target.clone().addScaledVector(out, distance) };
}
function toolbarShares() {
  // Of the height of the picture, over which they lie.
  if (motion.export) { return { top: 0, bottom: 0 }; }
  const box = canvas.getBoundingClientRect(), views = byId("views").getBoundingClientRect(), shows = byId("shows").getBoundingClientRect();
  function part(bar, length) { return bar.height ? Math.max(0, Math.min(0.25, length / box.height)) : 0; }
  return { top: part(views, views.bottom - box.top), bottom: part(shows, box.bottom - shows.top) };
}
function seeFrom(direction, at, jump) {
  const to = fitFor(direction, at), size = to.position.distanceTo(to.target);
  camera.near = size / 200; camera.far = size * 200 + 100 * runBox().size;
  camera.updateProjectionMatrix();
  if (followed >= 0) { followCentre(at, lastCentre); }
  if (jump || stillSystem.matches) {
    flight = null;
    camera.position.copy(to.position);
    orbit.target.copy(to.target);
    orbit.update();
    redraw();
    return;
  }
  flight = { begun: performance.now(), from: camera.position.clone(), to: to.position,
    origin: orbit.target.clone(), target: to.target };
  redraw();
}
function seeView(name, at, jump) { seeFrom(new THREE.Vector3().fromArray(VIEWS[name]), at, jump); }
function fit(at, jump) { seeFrom(camera.position.clone().sub(orbit.target), at, jump); }
function fly(now) {
  // A quarter of a second to a preset view, round the target rather than through it.
  if (!flight) { return; }
  const part = Math.min(1, (now - flight.begun) / 280), s = part * part * (3 - 2 * part);
  const a = spare.subVectors(flight.from, flight.origin), b = spare2.subVectors(flight.to, flight.target);
  const distance = a.length() + s * (b.length() - a.length());
  orbit.target.lerpVectors(flight.origin, flight.target, s);
  camera.position.copy(a.normalize().lerp(b.normalize(), s).normalize().multiplyScalar(distance).add(orbit.target));
  orbit.update();
  if (part >= 1) { flight = null; }
  redraw();
}
function turnBy(across, upwards) {
  const away = camera.position.clone().sub(orbit.target), round = new THREE.Spherical().setFromVector3(away);
  round.theta -= across;
  round.phi = Math.max(0.02, Math.min(Math.PI - 0.02, round.phi - upwards));
  camera.position.copy(orbit.target).add(away.setFromSpherical(round));
  orbit.update();
}
function zoomBy(factor) {
  camera.position.sub(orbit.target).multiplyScalar(factor).add(orbit.target);
  orbit.update();
}
