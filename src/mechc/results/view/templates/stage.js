// The renderer, lights, ground and grid.  World coordinates: x to the right, y up, z to the viewer.
const stage = byId("stage"), canvas = byId("canvas");
const scene = new THREE.Scene(), world = new THREE.Group();
let renderer = null, grid = null, wanted = false, cell = 1;
const discarded = [];  // disposed of once those are drawn that share their programs
scene.add(world);
scene.add(new THREE.HemisphereLight(0xffffff, 0x99a0ad, 0.72));
const sun = new THREE.DirectionalLight(0xffffff, 0.5);
scene.add(sun);

function isSoftware() {
  // Without a graphics processor smooth edges cost half of the frames.
  const probe = document.createElement("canvas").getContext("webgl");
  const names = probe && probe.getExtension("WEBGL_debug_renderer_info");
  const name = names ? String(probe.getParameter(names.UNMASKED_RENDERER_WEBGL)) : "";
  if (probe && probe.getExtension("WEBGL_lose_context")) { probe.getExtension("WEBGL_lose_context").loseContext(); }
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}
const smooth = Boolean(motion.export) || !isSoftware();

function startStage() {
  try {
    renderer = new THREE.WebGLRenderer({ canvas: canvas, antialias: smooth, alpha: true });
  } catch (refused) {
    byId("failure").hidden = false;
    byId("failure").textContent = "This browser draws nothing in space (WebGL is off): the plots still work.";
    return false;
  }
  const right = new THREE.Vector3().fromArray(motion.right), up = new THREE.Vector3().fromArray(motion.up);
  const turn = new THREE.Matrix4().makeBasis(right, up, new THREE.Vector3().crossVectors(right, up));
  world.quaternion.setFromRotationMatrix(turn).invert();
  world.updateMatrixWorld(true);
  return true;
}
function resize() {
  const box = canvas.getBoundingClientRect();
  if (!renderer || !(box.width > 0 && box.height > 0)) { return; }
  renderer.setPixelRatio(Math.min(smooth ? 2 : 1, window.devicePixelRatio || 1));
  renderer.setSize(box.width, box.height, false);
  camera.aspect = box.width / box.height;
  camera.updateProjectionMatrix();
  redraw();
}
function redraw() {
  if (wanted || !renderer) { return; }
  wanted = true;
  requestAnimationFrame(function (now) {
    wanted = false;
    fly(now);
    render();
  });
}
function render() {
  if (!renderer) { return; }
  sun.position.copy(camera.position).add(spare.set(0.3, 0.9, 0.2).multiplyScalar(camera.position.distanceTo(orbit.target)));
  sun.target.position.copy(orbit.target);
  sun.target.updateMatrixWorld();
  renderer.render(scene, camera);
  discarded.splice(0).forEach(dispose);
}

// -- grid -------------------------------------------------------------------------------------
function addGrid() {
  // Under a motion in space; behind one in a plane.
  const axes = motion.flat ? [0, 1, 2] : [0, 2, 1], frames = Math.max(1, Math.floor(motion.frames / 240));
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const along = [0, 1, 2].map(function (k) { return new THREE.Vector3().setComponent(k, 1); });
  for (let f = 0; f < motion.frames; f += frames) {
    eachBody(f, function (position, support) {
      along.forEach(function (axis, k) {
        const x = position.getComponent(k), size = support(axis);
        low[k] = Math.min(low[k], x - size); high[k] = Math.max(high[k], x + size);
      });
    });
  }
  if (!(high[0] >= low[0])) { return; }
  const size = Math.max(60 * unit, Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]));
  cell = roundDown(Math.max(Math.min(size / 9, 0.6 * bodySize()), size / 120));
  const level = motion.flat ? low[2] - 2 * unit : Math.min(low[1], pivotBase());
  const ends = axes.slice(0, 2).map(function (a) {
    return [Math.floor(low[a] / cell - 0.4) * cell, Math.ceil(high[a] / cell + 0.4) * cell];
  });
  const corners = [];
  function line(a, other, at) {
    // In pieces: software drops lines that begin behind the camera.
    const pieces = Math.max(1, Math.round((ends[a][1] - ends[a][0]) / (2 * cell)));
    for (let k = 0; k < pieces; k += 1) {
      [k, k + 1].forEach(function (j) {
        const corner = [0, 0, 0];
        corner[axes[a]] = ends[a][0] + (ends[a][1] - ends[a][0]) * j / pieces;
        corner[axes[other]] = at; corner[axes[2]] = level;
        corners.push(corner[0], corner[1], corner[2]);
      });
    }
  }
  for (let a = 0; a < 2; a += 1) {
    const count = Math.round((ends[1 - a][1] - ends[1 - a][0]) / cell);
    for (let k = 0; k <= count; k += 1) { line(a, 1 - a, ends[1 - a][0] + k * cell); }
  }
  const shape = new THREE.BufferGeometry();
  shape.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
  grid = new THREE.LineSegments(shape, new THREE.LineBasicMaterial({ transparent: true, opacity: 0.85 }));
  scene.add(grid);
  tellScale();
}
function tellScale() {
  const ofGrid = grid && grid.visible ? ["grid: " + threeDigits(cell) + " m"] : [];
  byId("scale").textContent = ofGrid.concat(wordsOfForces(cell, USUAL * unit)).join(" \u00b7 ");
}
function pivotBase() {
  return motion.ground.reduce(function (least, point) {
    return Math.min(least, world.localToWorld(place(point, 0, spare)).y - 4.8 * unit);
  }, Infinity);
}
themeUsers.push(function () {
  if (grid) { grid.material.color.set(look.line); }
  redraw();
});
