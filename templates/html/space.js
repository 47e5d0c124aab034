// A mechanism in space by three.js: one group a body, moved by packed positions and quaternions; dragging turns the view.
"use strict";

function spaceStage(root, data) {
  const THREE = MeshCat.THREE, rows = data.times.length, poses = unpack(data.poses, rows), ropes = unpack(data.ropes, rows);
  const canvas = root.querySelector("canvas"), size = data.size, scene = new THREE.Scene();
  const renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
  const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, -100 * size, 100 * size);
  scene.add(new THREE.HemisphereLight(0xffffff, 0x8899aa, 0.95));
  const sun = new THREE.DirectionalLight(0xffffff, 0.45);
  scene.add(sun);
  const up = new THREE.Vector3(...data.up), middle = new THREE.Vector3(...data.middle);
  const sprites = [], shades = [];
  let azimuth = 0, elevation = 0, zoom = 1, half = 0.5 * data.reach, centre = middle, shown = null, follows = data.follow;
  let sharpness = null; // pixels of the canvas for one of the page, as many as the screen has but for a saved frame

  // Inks differ between white paper and a dark page: materials that have one keep both colours.
  function shaded(material, light, dark) {
    shades.push([material, light, dark]);
    material.color.setHex(light);
    return material;
  }
  function onPaper(colour) {
    renderer.setClearColor(colour);
    const { r, g, b } = colour, dark = r + g + b < 1.5;
    for (const [material, ...inks] of shades) material.color.setHex(inks[Number(dark)]);
    trails.forEach((trail) => { trail.paper = colour; });
  }
  const paper = () => new THREE.Color(getComputedStyle(root).backgroundColor);
  const STEEL = [0x475569, 0x94a3b8];

  const groups = data.bodies.map(() => { const g = new THREE.Group(); scene.add(g); return g; });
  const ground = new THREE.Group();
  scene.add(ground);
  const strands = data.pieces.map(([, count], number) => {
    const spring = data.kinds[number].startsWith("spring"), points = spring ? 193 : count;
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * points), 3));
    const inks = data.kinds[number] === "rope" ? [0x5b3a1e, 0xc9a27c] : [0x334155, 0xb6c2d1];
    const line = new THREE.Line(geometry, shaded(new THREE.LineBasicMaterial(), ...inks));
    line.frustumCulled = false;
    scene.add(line);
    return { line, spring };
  });
  const trails = data.traces.map(({ colour }) => {
    const geometry = new THREE.BufferGeometry();
    for (const name of ["position", "color"])
      geometry.setAttribute(name, new THREE.BufferAttribute(new Float32Array(3 * rows + 3), 3));
    const line = new THREE.Line(geometry, new THREE.LineBasicMaterial({ vertexColors: true }));
    line.frustumCulled = false;
    scene.add(line);
    return { line, ink: new THREE.Color(colour), paper: new THREE.Color(0xffffff) };
  });

  const lines = (width) => (data.near ? Math.max(10, Math.min(200, Math.round(width / data.near))) : 10);
  function paint(colour, clear, onDark = colour) {
    const look = { transparent: clear < 1, opacity: clear, side: THREE.DoubleSide };
    return shaded(new THREE.MeshLambertMaterial(look), colour, onDark);
  }
  function grid(width, middle, others, way, at) {
    const found = new THREE.GridHelper(width, lines(width), middle, others);
    shaded(found.material, 0xffffff, 0x4a525c); // which multiplies the colours of its lines
    along(found, way);
    found.position.copy(at);
    return found;
  }
  function along(mesh, way, from = [0, 1, 0]) {
    mesh.quaternion.setFromUnitVectors(new THREE.Vector3(...from), new THREE.Vector3(...way).normalize());
    return mesh;
  }
  function bar(group, a, b, radius, material) {
    const from = new THREE.Vector3(...a), to = new THREE.Vector3(...b), way = to.clone().sub(from), length = way.length();
    if (!(length > 0)) return;
    const mesh = new THREE.Mesh(new THREE.CylinderGeometry(radius, radius, length, 14), material);
    along(mesh, way.toArray());
    mesh.position.copy(from.add(to).multiplyScalar(0.5));
    group.add(mesh);
  }
  function solid(group, geometry, material, at, way, from) {
    const mesh = new THREE.Mesh(geometry, material);
    if (way) along(mesh, way, from);
    mesh.position.set(...at);
    group.add(mesh);
    return mesh;
  }
  const builders = {
    Polyline(group, item, material) {
      const points = item.points;
      if (item.closed && points.length > 2) {
        const flat = new THREE.BufferGeometry(), corners = [];
        for (let k = 1; k + 1 < points.length; k++) corners.push(...points[0], ...points[k], ...points[k + 1]);
        flat.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
        flat.computeVertexNormals();
        group.add(new THREE.Mesh(flat, material));
      }
      const radius = (points.length > 12 ? 0.004 : 0.011) * size;
      for (let k = 0; k + 1 < points.length + (item.closed ? 1 : 0); k++) bar(group, points[k], points[(k + 1) % points.length], radius, material);
    },
    Disc(group, item, material) {
      const wheel = item.hollow ? new THREE.TorusGeometry(item.radius, 0.012 * size, 10, 48) : new THREE.CylinderGeometry(item.radius, item.radius, 0.025 * size, 48);
      solid(group, wheel, material, item.centre, item.axis, item.hollow ? [0, 0, 1] : [0, 1, 0]);
    },
    Sphere(group, item) {
      solid(group, new THREE.SphereGeometry(item.radius, 32, 20), paint(item.colour, item.hollow ? 0.25 : 1), item.centre);
    },
    Block(group, item, material) {
      const mesh = solid(group, new THREE.BoxGeometry(...item.sizes.map((x) => Math.max(x, 0.004 * size))), material, item.centre);
      const r = item.rotation, turn = new THREE.Matrix4();
      turn.set(r[0][0], r[0][1], r[0][2], 0, r[1][0], r[1][1], r[1][2], 0, r[2][0], r[2][1], r[2][2], 0, 0, 0, 0, 1);
      mesh.quaternion.setFromRotationMatrix(turn);
    },
    Bowl(group, item) {
      const points = item.profile.map(([way, height]) => new THREE.Vector2(way, height));
      solid(group, new THREE.LatheGeometry(points, 48), paint(item.colour, 0.3), item.centre, item.axis);
    },
    Barrel(group, item, material) {
      solid(group, new THREE.CylinderGeometry(item.radius, item.radius, item.length, 40), material, item.centre, item.axis);
    },
    Cone(group, item, material) {
      const mesh = solid(group, new THREE.ConeGeometry(item.radius, item.height, 40), material, item.tip, item.axis, [0, -1, 0]);
      mesh.translateY(-item.height / 2);
    },
    Face(group, item) {
      // As far as the motion goes where it is ground's, around the middle of the motion.
      const width = item.body < 0 ? Math.max(2.2 * size, data.floor.width) + 6 * (data.near || 0) : 2.2 * size;
      const normal = new THREE.Vector3(...item.normal), at = new THREE.Vector3(...item.through);
      if (item.body < 0) at.copy(middle.clone().addScaledVector(normal, at.sub(middle).dot(normal)));
      solid(group, new THREE.PlaneGeometry(width, width), paint(0xd9dee4, 0.5, 0x4a525c), at.toArray(), item.normal, [0, 0, 1]);
      group.add(grid(width, 0xaab2bc, 0xc5ccd4, item.normal, at));
    },
    Rail(group, item) {
      const at = new THREE.Vector3(...item.at), axis = new THREE.Vector3(...item.axis);
      const ends = item.reach.map((x) => at.clone().addScaledVector(axis, x).toArray());
      bar(group, ends[0], ends[1], (item.light ? 0.003 : 0.006) * size, paint(0x9aa3ad, 1));
    },
    Stop(group, item) {
      const axis = new THREE.Vector3(...item.axis), front = (item.front || 0.035 * size) + 0.006 * size;
      const at = new THREE.Vector3(...item.at).addScaledVector(axis, front).toArray();
      solid(group, new THREE.CylinderGeometry(0.045 * size, 0.045 * size, 0.012 * size, 24), paint(STEEL[0], 1, STEEL[1]), at, item.axis);
    },
    TurnStop(group, item) {
      const way = new THREE.Vector3(...item.way), barred = new THREE.Vector3(...item.axis).cross(way);
      const at = new THREE.Vector3(...item.at).addScaledVector(way, Math.min(0.62 * item.reach, 0.12 * size));
      const bar = new THREE.Mesh(new THREE.BoxGeometry(0.06 * size, 0.012 * size, 0.04 * size), paint(STEEL[0], 1, STEEL[1]));
      bar.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(way, barred, new THREE.Vector3(...item.axis)));
      bar.position.copy(at.addScaledVector(barred, 0.017 * size));
      group.add(bar);
    },
    Symbol(group, item, material) {
      (symbols[item.kind] || symbols.point)(group, item, material);
    },
  };
  const pin = (group, item) => solid(group, new THREE.CylinderGeometry(0.02 * size, 0.02 * size, 0.07 * size, 20), paint(STEEL[0], 1, STEEL[1]), item.at, item.axis);
  const ball = (radius, colour) => (group, item, material) => solid(group, new THREE.SphereGeometry(radius * size, 24, 16), colour === null ? material : paint(colour, 1, STEEL[1]), item.at);
  const block = (group, item, material) => solid(group, new THREE.BoxGeometry(0.07 * size, 0.045 * size, 0.045 * size), material, item.at, item.along, [1, 0, 0]);
  const nothing = () => {};
  const symbols = {
    pin, pivot(group, item) {
      pin(group, item);
      solid(group, new THREE.SphereGeometry(0.028 * size, 20, 14), paint(0x1f2937, 1, 0xcbd5e1), item.at);
    },
    ball: ball(0.026, STEEL[0]), bob: ball(0.04, null), particle: ball(0.03, null), block, slider: block, hanger: block, rotor: ball(0.04, null),
    com: nothing, frame(group, item) { const axes = new THREE.AxesHelper(0.06 * size); axes.position.set(...item.at); group.add(axes); },
    point: ball(0.008, 0x6b7280), used_point: nothing, tie: nothing, free: nothing, contact: nothing,
  };
  for (const item of data.items) {
    const group = item.body < 0 ? ground : groups[item.body];
    (builders[item.form] || nothing)(group, item, paint(item.colour, 1));
  }

  // The ground, as the eye needs it: a level grid below everything where no plane is declared, and the axes of space.
  const low = data.low;
  if (!data.items.some((item) => item.form === "Face" && item.body < 0)) {
    scene.add(grid(data.floor.width, 0xb4bcc6, 0xd7dce2, data.up, new THREE.Vector3(...data.floor.middle)));
  }
  [[1, 0, 0, 0xb01217, 0xff8a80], [0, 1, 0, 0x1d6b2f, 0x7bd88f], [0, 0, 1, 0x0b5394, 0x82b8ff]].forEach(([x, y, z, ...inks], k) => {
    const way = new THREE.Vector3(x, y, z), from = new THREE.Vector3(...low);
    const arrow = new THREE.ArrowHelper(way, from, 0.16 * size, inks[0], 0.04 * size, 0.02 * size);
    shaded(arrow.line.material, ...inks);
    shaded(arrow.cone.material, ...inks);
    scene.add(arrow, lettered("xyz"[k], from.addScaledVector(way, 0.2 * size), inks));
  });

  // The letter of an axis on a small picture that faces the reader.
  function lettered(letter, at, inks) {
    const picture = document.createElement("canvas"), pen = picture.getContext("2d"), type = 44;
    picture.width = picture.height = 1.5 * type;
    pen.fillStyle = "#fff"; // which its material multiplies
    pen.font = `italic ${type}px serif`;
    pen.textAlign = "center";
    pen.fillText(letter, picture.width / 2, type);
    const texture = new THREE.CanvasTexture(picture);
    texture.minFilter = THREE.LinearFilter;
    const sprite = new THREE.Sprite(shaded(new THREE.SpriteMaterial({ map: texture, transparent: true, depthTest: false }), ...inks));
    sprite.position.copy(at);
    sprite.renderOrder = 10;
    sprites.push(sprite);
    return sprite;
  }
  const names = data.names.length ? nameLayer(root, data.names, data.rule) : null;
  // What letters keep clear of: bars, and the rims of discs and rings, as lines of a width (m).
  function rim({ centre, axis, radius }) {
    const way = new THREE.Vector3(...axis).normalize(), side = new THREE.Vector3(1, 0, 0);
    if (Math.abs(way.x) > 0.9) side.set(0, 1, 0);
    side.cross(way).normalize().multiplyScalar(radius);
    const at = (k) => side.clone().applyAxisAngle(way, k * Math.PI / 12).add(new THREE.Vector3(...centre)).toArray();
    return Array.from({ length: 25 }, (_, k) => at(k));
  }
  const outlines = data.items.flatMap((item) => {
    if (item.form === "Disc") return [{ body: item.body, points: rim(item), half: item.hollow ? 0.012 * size : 0 }];
    return item.form === "Polyline" && item.points.length <= 12 ? [{ body: item.body, points: item.points, half: 0.011 * size }] : [];
  });
  function named() {
    const wide = canvas.clientWidth, high = canvas.clientHeight, p = new THREE.Vector3();
    const seen = (body, at) => {
      p.set(...at);
      if (body >= 0) p.applyQuaternion(groups[body].quaternion).add(groups[body].position);
      p.project(camera);
      return [(p.x + 1) / 2 * wide, (1 - p.y) / 2 * high];
    };
    const pixel = high / (2 * half);
    const lines = outlines.flatMap(({ body, points, half: radius }) => {
      const found = points.map((point) => seen(body, point));
      return found.slice(1).map((end, k) => ({ start: found[k], end, half: radius * pixel, body }));
    });
    names.show(data.names.map(({ body, at }) => seen(body, at)), lines, 0.025 * size * pixel);
  }

  function quaternion(v, a) { return new THREE.Quaternion(v[a], v[a + 1], v[a + 2], v[a + 3]); }
  function poseOf(body, low, high, part, position, turn) {
    const v = poses.values, a = low * poses.columns + 7 * body, b = high * poses.columns + 7 * body;
    position.set(v[a] + part * (v[b] - v[a]), v[a + 1] + part * (v[b + 1] - v[a + 1]), v[a + 2] + part * (v[b + 2] - v[a + 2]));
    turn.copy(quaternion(v, a + 3)).normalize().slerp(quaternion(v, b + 3).normalize(), part);
  }
  function place(number, low, high, part) {
    const [first, count] = data.pieces[number], v = ropes.values, found = [];
    for (let k = 0; k < count; k++) {
      const a = low * ropes.columns + first + 3 * k, b = high * ropes.columns + first + 3 * k;
      found.push(new THREE.Vector3(v[a] + part * (v[b] - v[a]), v[a + 1] + part * (v[b + 1] - v[a + 1]), v[a + 2] + part * (v[b + 2] - v[a + 2])));
    }
    return found;
  }
  function coil(a, b) {
    const way = b.clone().sub(a), e = way.clone().normalize(), found = [];
    const f = (Math.abs(e.x) < 0.9 ? new THREE.Vector3(1, 0, 0) : new THREE.Vector3(0, 1, 0)).cross(e).normalize(), g = e.clone().cross(f);
    for (let k = 0; k <= 192; k++) {
      const s = k / 192, r = s < 0.1 || s > 0.9 ? 0 : 0.025 * size, turn = 2 * Math.PI * 9 * s;
      found.push(a.clone().addScaledVector(way, s).addScaledVector(f, r * Math.cos(turn)).addScaledVector(g, r * Math.sin(turn)));
    }
    return found;
  }
  function fill(line, points) {
    const array = line.geometry.attributes.position.array;
    points.forEach((p, k) => p.toArray(array, 3 * k));
    line.geometry.setDrawRange(0, points.length);
    line.geometry.attributes.position.needsUpdate = true;
  }
  function look() {
    const wide = root.clientWidth || 640, high = Math.round(0.62 * Math.min(wide, window.innerHeight || wide)), ratio = sharpness || Math.min(2, window.devicePixelRatio || 1);
    if (canvas.width !== Math.round(wide * ratio) || canvas.height !== Math.round(high * ratio)) { renderer.setPixelRatio(ratio); renderer.setSize(wide, high, false); }
    const near = data.near && follows, aspect = wide / high; // the ground passes below what is followed
    half = 0.5 * (near ? 1.6 * data.near : data.reach) / zoom;
    centre = near ? groups.reduce((sum, group) => sum.add(group.position), new THREE.Vector3()).divideScalar(groups.length) : middle;
    Object.assign(camera, { left: -half * aspect, right: half * aspect, top: half, bottom: -half });
    const right = new THREE.Vector3(...data.right).applyAxisAngle(up, azimuth);
    const towards = new THREE.Vector3(...data.towards).applyAxisAngle(up, azimuth).applyAxisAngle(right, elevation);
    const letter = 2 * half * 15 / high; // letters of 15 pixels, however far the view is
    for (const sprite of sprites) sprite.scale.set(1.5 * letter, 1.5 * letter, 1);
    camera.up.copy(up);
    camera.position.copy(centre).addScaledVector(towards, 10 * size);
    camera.lookAt(centre);
    camera.updateProjectionMatrix();
    sun.position.copy(camera.position).addScaledVector(up, 4 * size).addScaledVector(right, 3 * size);
    renderer.render(scene, camera);
    if (names) named();
  }
  function way({ body, at }, first, low, high, part) { // the points of a path up to now
    const found = [], p = new THREE.Vector3(), q = new THREE.Quaternion();
    const add = (...instant) => { poseOf(body, ...instant, p, q); found.push(new THREE.Vector3(...at).applyQuaternion(q).add(p)); };
    for (let k = first; k <= low; k++) add(k, k, 0);
    add(low, high, part);
    return found;
  }
  function drawTrail({ line, ink, paper }, points, fades) {
    const colours = line.geometry.attributes.color, colour = new THREE.Color();
    points.forEach((_, k) => colour.copy(paper).lerp(ink, fades ? (k + 1) / points.length : 1).toArray(colours.array, 3 * k));
    colours.needsUpdate = true;
    fill(line, points);
  }
  function show(low, high, part, trail) {
    shown = [low, high, part, trail];
    groups.forEach((group, body) => poseOf(body, low, high, part, group.position, group.quaternion));
    strands.forEach(({ line, spring }, number) => {
      const points = place(number, low, high, part);
      fill(line, spring ? coil(points[0], points[points.length - 1]) : points);
    });
    trails.forEach((each, k) => {
      each.line.visible = trail.shown[k];
      if (trail.shown[k]) drawTrail(each, way(data.traces[k], trail.first, low, high, part), trail.fades);
    });
    look();
  }
  function recolour(colour = paper()) {
    onPaper(colour);
    if (shown) show(...shown);
  }
  onGestures(canvas, (dx, dy) => {
    azimuth -= dx * 0.008;
    elevation = Math.max(-1.5, Math.min(1.5, elevation - dy * 0.008));
    show(...shown);
  }, (factor) => { zoom *= factor; show(...shown); });
  recolour();
  return {
    switches: {
      ...(names && { names: names.turn }),
      ...(data.near && { follow: (on) => { follows = on; } }),
    },
    show,
    reset() { [azimuth, elevation, zoom] = [0, 0, 1]; },
    recolour,
    paint(pen, wide, high) { // as on paper
      sharpness = 2;
      recolour(new THREE.Color(0xffffff));
      pen.drawImage(canvas, 0, 0, wide, high);
      sharpness = null;
      recolour();
    },
  };
}
