// A plane mechanism as SVG: what each body carries is drawn once and moved; strands are stretched, ropes drawn anew.
"use strict";

function planeStage(root, data) {
  const svg = root.querySelector("svg"), rows = data.times.length, poses = unpack(data.poses, rows), ropes = unpack(data.ropes, rows);
  const groups = [...svg.querySelectorAll("g[data-body]")].map((g) => [g, Number(g.dataset.body)]);
  const strands = [...svg.querySelectorAll("g[data-strand]")].map((g) => [g, Number(g.dataset.strand)]);
  const lines = [...svg.querySelectorAll("path[data-rope]")].map((p) => [p, Number(p.dataset.rope)]);
  const trails = [...svg.querySelectorAll("path[data-trace]")].map((p) => [p, data.traces[Number(p.dataset.trace)]]);
  const height = data.height;

  function pose(body, low, high, part) {
    const a = low * poses.columns + 3 * body, b = high * poses.columns + 3 * body, v = poses.values;
    let turn = v[b + 2] - v[a + 2];
    turn -= 2 * Math.PI * Math.round(turn / (2 * Math.PI));
    return [v[a] + part * (v[b] - v[a]), v[a + 1] + part * (v[b + 1] - v[a + 1]), v[a + 2] + part * turn];
  }
  // SVG counts y downwards: a place (x, y) of the page is drawn at (x, height - y), and turns change their sign.
  function matrix(body, low, high, part) {
    const [x, y, turn] = pose(body, low, high, part), [hx, hy, home] = data.home[body];
    const c = Math.cos(turn - home), s = -Math.sin(turn - home), py = height - y, qy = height - hy;
    return [c, s, -s, c, x - (c * hx - s * qy), py - (s * hx + c * qy)];
  }
  function rope(number, low, high, part) {
    const [first, count] = data.pieces[number], v = ropes.values, found = [];
    for (let k = 0; k < count; k++) {
      const a = low * ropes.columns + first + 2 * k, b = high * ropes.columns + first + 2 * k;
      found.push([v[a] + part * (v[b] - v[a]), height - (v[a + 1] + part * (v[b + 1] - v[a + 1]))]);
    }
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
  function follow(low, high, part) { // the middle of all bodies in the middle of the window
    const places = data.home.map((_, body) => pose(body, low, high, part)), mean = (k) => places.reduce((sum, p) => sum + p[k], 0) / places.length;
    const [wide, tall] = data.window, x = wide / 2 - mean(0), y = tall / 2 - (height - mean(1));
    svg.querySelector("g").setAttribute("transform", `translate(${x.toFixed(2)} ${y.toFixed(2)})`);
  }
  function trail(point, low) {
    const found = [], step = Math.max(1, Math.floor(low / 1500));
    for (let k = 0; k <= low; k += step) {
      const m = matrix(point.body, k, k, 0);
      found.push((m[0] * point.at[0] + m[2] * point.at[1] + m[4]).toFixed(1) + " " + (m[1] * point.at[0] + m[3] * point.at[1] + m[5]).toFixed(1));
    }
    return "M" + found.join("L");
  }
  const moved = ([x, y], m) => [m[0] * x + m[2] * y + m[4], m[1] * x + m[3] * y + m[5]];
  const names = data.names && data.names.length ? nameLayer(root, data.names, data.rule) : null;
  function named(low, high, part) {
    const at = new Map(), still = [1, 0, 0, 1, 0, 0];
    const of = (body) => { if (!at.has(body)) at.set(body, body < 0 ? still : matrix(body, low, high, part)); return at.get(body); };
    const { a, e, f } = svg.querySelector("g").getScreenCTM(), { left, top } = root.getBoundingClientRect();
    const seen = (body, point) => { const [x, y] = moved(point, of(body)); return [a * x + e - left, a * y + f - top]; };
    const lines = data.lines.flatMap(({ body, points }) => {
      const found = points.map((point) => seen(body, point));
      return found.slice(1).map((point, k) => [...found[k], ...point]);
    });
    names.show(data.names.map(({ body, at: place }) => seen(body, place)), lines, 3.5 * a);
  }
  const written = (m) => "matrix(" + m.map((x) => x.toFixed(4)).join(" ") + ")";
  return {
    show(low, high, part, traced) {
      if (data.window) follow(low, high, part);
      for (const [g, body] of groups) g.setAttribute("transform", written(matrix(body, low, high, part)));
      for (const [g, number] of strands) g.setAttribute("transform", written(stretched(number, low, high, part)));
      for (const [p, number] of lines)
        p.setAttribute("d", "M" + rope(number, low, high, part).map(([x, y]) => x.toFixed(2) + " " + y.toFixed(2)).join("L"));
      for (const [p, point] of trails) p.setAttribute("d", traced ? trail(point, low) : "");
      if (names) named(low, high, part);
    },
  };
}
