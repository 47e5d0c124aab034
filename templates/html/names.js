// Names beside what they name, by the rule of figures: of the places around it the cheapest that touches no other letters
// and no other sign, with a leader where it is far. A name stays in its place as long as that is free and on no line.
"use strict";

function nameLayer(root, names, rule) {
  const tag = (kind, parent) => parent.appendChild(document.createElementNS("http://www.w3.org/2000/svg", kind));
  const group = tag("svg", root), pen = document.createElement("canvas").getContext("2d"), type = 15, air = 1.2;
  group.setAttribute("class", "names");
  group.setAttribute("aria-hidden", "true");
  const wide = (runs) => runs.reduce((sum, [text, style]) => {
    pen.font = `${style === "italic" ? "italic " : ""}${(style === "subscript" || style === "small" ? 0.75 : 1) * type}px serif`;
    return sum + pen.measureText(text).width;
  }, 0);
  const labels = names.map(({ runs, body }) => {
    const line = tag("path", group), text = tag("text", group);
    text.setAttribute("font-family", "serif");
    for (const [letters, style] of runs) {
      const span = tag("tspan", text);
      span.textContent = letters;
      span.setAttribute("font-size", (style === "subscript" || style === "small" ? 0.75 : 1) * type);
      if (style === "italic") span.setAttribute("font-style", "italic");
      if (style === "subscript") span.setAttribute("baseline-shift", "sub");
    }
    const halo = "paint-order:stroke;stroke:var(--paper,#fff);stroke-width:3px;stroke-linejoin:round";
    text.setAttribute("style", `${halo};fill:var(--ink,#1a1a1a)`);
    line.setAttribute("style", "stroke:var(--quiet,#555);stroke-width:0.8px;fill:none");
    const low = runs.some(([, style]) => style === "subscript"); // what stands below needs room
    return { body, line, text, half: [wide(runs) / 2, (low ? 0.78 : 0.58) * type], foot: (low ? 0.14 : 0.35) * type, kept: null };
  });
  function* tried({ half }, steps, sign) {
    for (const step of steps)
      for (let i = 0; i < rule.angles.length; i++) {
        const x = Math.cos(rule.angles[i]), y = -Math.sin(rule.angles[i]), reach = sign + rule.clear + step;
        const near = (c) => Math.max(-1, Math.min(1, 1.5 * c));
        yield { at: [x * reach + near(x) * half[0], y * reach + near(y) * half[1]], way: [x, y], step, cost: step + 0.15 * i };
      }
  }
  const around = ([x, y], [dx, dy], [w, h]) => [x + dx - w - air, y + dy - h - air, x + dx + w + air, y + dy + h + air];
  const meet = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
  function over({ start: [ax, ay], end: [bx, by], half }, box) { // whether a line, of its width and some air, meets a box
    const cx = (box[0] + box[2]) / 2, cy = (box[1] + box[3]) / 2, wider = half + rule.clear;
    const w = (box[2] - box[0]) / 2 + wider, h = (box[3] - box[1]) / 2 + wider;
    const mx = (ax + bx) / 2 - cx, my = (ay + by) / 2 - cy, rx = (bx - ax) / 2, ry = (by - ay) / 2;
    if (Math.abs(mx) > w + Math.abs(rx) || Math.abs(my) > h + Math.abs(ry)) return false;
    return Math.abs(rx * my - ry * mx) <= w * Math.abs(ry) + h * Math.abs(rx);
  }
  function leader(lines, body, from, to, sign) { // from where the way to a far name leaves the lines of its own body, to there
    let last = 0, wide = sign;
    const dx = to[0] - from[0], dy = to[1] - from[1];
    for (const { start: [ax, ay], end: [bx, by], half } of lines.filter((line) => line.body === body)) {
      const ex = bx - ax, ey = by - ay, cross = dx * ey - dy * ex, fx = ax - from[0], fy = ay - from[1];
      const along = (fx * ey - fy * ex) / cross, across = (fx * dy - fy * dx) / cross;
      if (along > last && along <= 1 && across >= 0 && across <= 1) last = along;
      wide = Math.max(wide, half);
    }
    const far = (1 - last) * Math.hypot(dx, dy) > rule.leader + wide;
    return far ? `M${(from[0] + last * dx).toFixed(1)} ${(from[1] + last * dy).toFixed(1)}L${to.map((c) => c.toFixed(1))}` : "";
  }
  function place(places, lines, sign) {
    const taken = [];
    labels.forEach((label, k) => {
      const at = places[k], others = places.filter((p) => Math.hypot(p[0] - at[0], p[1] - at[1]) > sign);
      const signs = others.map(([x, y]) => [x - sign, y - sign, x + sign, y + sign]);
      const free = (one) => {
        const box = around(at, one.at, label.half);
        return !taken.some((other) => meet(box, other)) && !signs.some((other) => meet(box, other));
      };
      const crossed = (one) => {
        const box = around(at, one.at, label.half);
        return lines.filter((line) => over(line, box)).length;
      };
      const dear = (one) => one.cost + rule.crossed * crossed(one);
      const stays = label.kept && free(label.kept);
      if (!stays || crossed(label.kept)) {
        let best = stays ? [dear(label.kept) - 1, label.kept] : [Infinity, null];
        for (const steps of rule.rings) {
          for (const one of tried(label, steps, sign)) {
            if (one.cost >= best[0] || !free(one)) continue;
            const cost = dear(one);
            if (cost < best[0]) best = [cost, one];
          }
          if (best[0] < rule.crossed) break; // it touches nothing
        }
        label.kept = best[1] || tried(label, rule.rings[0], sign).next().value;
      }
      taken.push(around(at, label.kept.at, label.half));
    });
  }
  let on = true;
  return {
    show(places, lines, sign) { // places, lines and how far signs reach around their places, in pixels
      if (!on) return;
      place(places, lines, sign);
      labels.forEach(({ body, line, text, half, foot, kept }, k) => {
        const [x, y] = places[k], [dx, dy] = kept.at;
        text.setAttribute("x", (x + dx - half[0]).toFixed(1));
        text.setAttribute("y", (y + dy + foot).toFixed(1));
        const nearest = (from, middle, wide) => Math.max(middle - wide, Math.min(from, middle + wide));
        const end = [nearest(x, x + dx, half[0]), nearest(y, y + dy, half[1])];
        line.setAttribute("d", leader(lines, body, [x, y], end, sign));
      });
    },
    turn(shown) {
      on = shown;
      group.style.display = on ? "" : "none";
    },
  };
}
