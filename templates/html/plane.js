// A plane mechanism as SVG: what each body carries is drawn once and moved; strands are stretched, ropes drawn anew.
"use strict";

function planeStage(root, data) {
  const svg = root.querySelector("svg"), scene = svg.querySelector("g");
  const rows = data.times.length, poses = unpack(data.poses, rows), ropes = unpack(data.ropes, rows);
  const groups = [...svg.querySelectorAll("g[data-body]")].map((g) => [g, Number(g.dataset.body)]);
  const strands = [...svg.querySelectorAll("g[data-strand]")].map((g) => [g, Number(g.dataset.strand)]);
  const lines = [...svg.querySelectorAll("path[data-rope]")].map((p) => [p, Number(p.dataset.rope)]);
  const middles = data.middles && unpack(data.middles, rows), height = data.height;
  const box = svg.viewBox.baseVal, windowed = [0, 0, box.width, box.height]; // the whole motion, or a part that follows it
  const SPRING = 5; // half the width of a spring or damper (pt)
  const FADING = [0.15, 0.35, 0.55, 0.8, 1]; // how opaque the pieces of a trail are
  const trails = data.traces.map(({ colour }) => FADING.map(() => {
    const piece = document.createElementNS(svg.namespaceURI, "path");
    const look = { fill: "none", stroke: colour, "stroke-width": 1 };
    for (const [name, value] of Object.entries(look)) piece.setAttribute(name, value);
    return scene.insertBefore(piece, groups.length ? groups[0][0] : null);
  }));
  let home = windowed, view = home, shown = null;

  const between = (packed, column, low, high, part) => {
    const a = packed.values[low * packed.columns + column];
    return a + part * (packed.values[high * packed.columns + column] - a);
  };
  function pose(body, low, high, part) {
    const a = low * poses.columns + 3 * body + 2, b = high * poses.columns + 3 * body + 2, v = poses.values;
    let turn = v[b] - v[a];
    turn -= 2 * Math.PI * Math.round(turn / (2 * Math.PI));
    return [between(poses, 3 * body, low, high, part), between(poses, 3 * body + 1, low, high, part), v[a] + part * turn];
  }
  // SVG counts y downwards: a place (x, y) of the page is drawn at (x, height - y), and turns change their sign.
  function matrix(body, low, high, part) {
    const [x, y, turn] = pose(body, low, high, part), [hx, hy, first] = data.home[body];
    const c = Math.cos(turn - first), s = -Math.sin(turn - first), py = height - y, qy = height - hy;
    return [c, s, -s, c, x - (c * hx - s * qy), py - (s * hx + c * qy)];
  }
  const moved = ([x, y], m) => [m[0] * x + m[2] * y + m[4], m[1] * x + m[3] * y + m[5]];
  function rope(number, low, high, part) {
    const [first, count] = data.pieces[number], found = [];
    for (let k = first; k < first + 2 * count; k += 2)
      found.push([between(ropes, k, low, high, part), height - between(ropes, k + 1, low, high, part)]);
    return found;
  }
  function stretched(number, low, high, part) {
    const [[ax, ay], [bx, by]] = rope(number, low, high, part), [[cx, cy], [dx, dy]] = data.ends[number];
    const from = Math.hypot(dx - cx, dy - cy) || 1, to = Math.hypot(bx - ax, by - ay) || 1e-9;
    const u = [(dx - cx) / from, (dy - cy) / from], w = [(bx - ax) / to, (by - ay) / to], k = to / from;
    const a = w[0] * u[0] * k + w[1] * u[1], c = w[0] * u[1] * k - w[1] * u[0];
    const b = w[1] * u[0] * k - w[0] * u[1], d = w[1] * u[1] * k + w[0] * u[0];
    return [a, b, c, d, ax - (a * cx + c * cy), ay - (b * cx + d * cy)];
  }
  function slide(low, high, part) { // the middle of what moves in the middle of the window
    const x = home[2] / 2 - between(middles, 0, low, high, part), y = home[3] / 2 - height + between(middles, 1, low, high, part);
    return [x.toFixed(2), y.toFixed(2)];
  }
  function follow(on) {
    home = on ? windowed : [0, 0, ...data.whole];
    root.classList.toggle("whole", !on); // lines as wide as ever
    stage.reset();
  }
  const path = (points) => (points.length ? "M" + points.map(([x, y]) => x.toFixed(2) + " " + y.toFixed(2)).join("L") : "");
  function way({ body, at }, first, low, high, part) { // the points of a path up to now
    const found = [], step = Math.max(1, Math.floor((low - first) / 1500));
    for (let k = first; k <= low; k += step) found.push(moved(at, matrix(body, k, k, 0)));
    return [...found, moved(at, matrix(body, low, high, part))];
  }
  function drawTrail(pieces, points, fades) {
    const size = Math.ceil(points.length / pieces.length);
    pieces.forEach((piece, k) => {
      piece.setAttribute("d", path(points.slice(k * size, (k + 1) * size + 1)));
      piece.setAttribute("stroke-opacity", fades ? FADING[k] : 1);
    });
  }
  const names = data.names && data.names.length ? nameLayer(root, data.names, data.rule) : null;
  function named(low, high, part) {
    const at = new Map(), still = [1, 0, 0, 1, 0, 0];
    const of = (body) => {
      if (!at.has(body)) at.set(body, body < 0 ? still : matrix(body, low, high, part));
      return at.get(body);
    };
    const { a, e, f } = scene.getScreenCTM(), { left, top } = root.getBoundingClientRect();
    const seen = (body, point) => { const [x, y] = moved(point, of(body)); return [a * x + e - left, a * y + f - top]; };
    const pieces = (points, half, body) => points.slice(1).map((end, k) => ({ start: points[k], end, half: half * a, body }));
    const drawn = data.lines.flatMap(({ body, half, points }) => pieces(points.map((point) => seen(body, point)), half, body));
    for (const [elements, half] of [[strands, SPRING], [lines, 0]])
      for (const [, number] of elements)
        drawn.push(...pieces(rope(number, low, high, part).map((point) => seen(-1, point)), half, null));
    names.show(data.names.map(({ body, at: spot }) => seen(body, spot)), drawn, 4.8 * a);
  }
  function look() {
    svg.setAttribute("viewBox", view.map((x) => x.toFixed(3)).join(" "));
    if (shown) stage.show(...shown);
  }
  onGestures(svg, (dx, dy) => {
    const { a } = svg.getScreenCTM();
    view = [view[0] - dx / a, view[1] - dy / a, view[2], view[3]];
    look();
  }, (factor, x, y) => {
    const { a, e, f } = svg.getScreenCTM(), { left, top } = svg.getBoundingClientRect();
    const px = (x + left - e) / a, py = (y + top - f) / a, wide = Math.min(home[2], Math.max(home[2] / 50, view[2] / factor));
    const k = wide / view[2];
    view = [px + k * (view[0] - px), py + k * (view[1] - py), k * view[2], k * view[3]];
    root.classList.toggle("zoomed", k * view[2] < home[2]);
    look();
  });
  const written = (m) => "matrix(" + m.map((x) => x.toFixed(4)).join(" ") + ")";
  const stage = {
    switches: { ...(names && { names: names.turn }), ...(middles && { follow }) },
    show(low, high, part, { first, fades, shown: traced }) {
      shown = [low, high, part, { first, fades, shown: traced }];
      if (middles) scene.setAttribute("transform", `translate(${home === windowed ? slide(low, high, part) : data.shift})`);
      for (const [g, body] of groups) g.setAttribute("transform", written(matrix(body, low, high, part)));
      for (const [g, number] of strands) g.setAttribute("transform", written(stretched(number, low, high, part)));
      for (const [p, number] of lines) p.setAttribute("d", path(rope(number, low, high, part)));
      trails.forEach((pieces, k) => drawTrail(pieces, traced[k] ? way(data.traces[k], first, low, high, part) : [], fades));
      if (names) named(low, high, part);
    },
    reset() { view = home; root.classList.remove("zoomed"); look(); },
    recolour() {}, // style sheets do
    paint: (pen, wide, high) => paintSvg(pen, svg, wide, high),
  };
  return stage;
}
