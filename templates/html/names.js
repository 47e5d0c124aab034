// Names beside what they name, by the rule of figures: of the places around it the cheapest that touches no other letters
// and no other sign, with a leader where it is far. A name stays in its place as long as that is free.
"use strict";

function nameLayer(root, names, rule) {
  const tag = (kind, parent) => parent.appendChild(document.createElementNS("http://www.w3.org/2000/svg", kind));
  const group = tag("svg", root), pen = document.createElement("canvas").getContext("2d"), type = 15, air = 1.2;
  group.setAttribute("class", "names");
  const wide = (runs) => runs.reduce((sum, [text, style]) => {
    pen.font = `${style === "italic" ? "italic " : ""}${(style === "subscript" ? 0.75 : 1) * type}px serif`;
    return sum + pen.measureText(text).width;
  }, 0);
  const labels = names.map(({ runs }) => {
    const line = tag("path", group), text = tag("text", group);
    text.setAttribute("font-family", "serif");
    for (const [letters, style] of runs) {
      const span = tag("tspan", text);
      span.textContent = letters;
      span.setAttribute("font-size", (style === "subscript" ? 0.75 : 1) * type);
      if (style === "italic") span.setAttribute("font-style", "italic");
      if (style === "subscript") span.setAttribute("baseline-shift", "sub");
    }
    text.setAttribute("style", `paint-order:stroke;stroke:#fff;stroke-width:3px;stroke-linejoin:round;fill:#1a1a1a`);
    line.setAttribute("style", `stroke:#555;stroke-width:0.8px;fill:none`);
    const low = runs.some(([, style]) => style === "subscript"); // what stands below needs room
    return { line, text, half: [wide(runs) / 2, (low ? 0.78 : 0.58) * type], foot: (low ? 0.14 : 0.35) * type, kept: null };
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
  function over([ax, ay, bx, by], box) {
    const cx = (box[0] + box[2]) / 2, cy = (box[1] + box[3]) / 2, w = (box[2] - box[0]) / 2, h = (box[3] - box[1]) / 2;
    const mx = (ax + bx) / 2 - cx, my = (ay + by) / 2 - cy, rx = (bx - ax) / 2, ry = (by - ay) / 2;
    if (Math.abs(mx) > w + Math.abs(rx) || Math.abs(my) > h + Math.abs(ry)) return false;
    return Math.abs(rx * my - ry * mx) <= w * Math.abs(ry) + h * Math.abs(rx);
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
      const dear = (one) => one.cost + rule.crossed * lines.filter((line) => over(line, around(at, one.at, label.half))).length;
      if (!label.kept || !free(label.kept)) {
        let best = [Infinity, null];
        for (const steps of rule.rings) {
          for (const one of tried(label, steps, sign)) {
            if (one.cost >= best[0] || !free(one)) continue;
            const cost = dear(one);
            if (cost < best[0]) best = [cost, one];
          }
          if (best[0] < rule.crossed) break; // it touches nothing
        }
        label.kept = best[1];
        label.kept = label.kept || tried(label, rule.rings[0], sign).next().value;
      }
      taken.push(around(at, label.kept.at, label.half));
    });
  }
  const choice = document.createElement("label"), box = document.createElement("input");
  box.type = "checkbox";
  box.checked = true;
  choice.append(box, " names");
  const controls = root.parentElement.querySelector(".controls");
  if (controls && names.length) controls.append(choice);
  let last = null;
  const stage = {
    show(...given) { // places, lines and how far signs reach around their places, in pixels
      last = given;
      if (!box.checked) return;
      const [places] = given;
      place(...given);
      labels.forEach(({ line, text, half, foot, kept }, k) => {
        const [x, y] = places[k], [dx, dy] = kept.at;
        text.setAttribute("x", (x + dx - half[0]).toFixed(1));
        text.setAttribute("y", (y + dy + foot).toFixed(1));
        const end = [Math.max(x + dx - half[0], Math.min(x, x + dx + half[0])), Math.max(y + dy - half[1], Math.min(y, y + dy + half[1]))];
        line.setAttribute("d", kept.step < rule.leader ? "" : `M${x.toFixed(1)} ${y.toFixed(1)}L${end[0].toFixed(1)} ${end[1].toFixed(1)}`);
      });
    },
  };
  box.addEventListener("change", () => { group.style.display = box.checked ? "" : "none"; if (last) stage.show(...last); });
  return stage;
}
