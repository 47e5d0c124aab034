// Panels of curves on canvases: dragging zooms into a span of time, a double click shows all again, a click goes there.
"use strict";

function makePlots(root, data, go) {
  const rows = data.plot ? data.plot.x.length : 0;
  const panels = (data.plot ? data.plot.panels : []).map((panel) => makePanel(root, panel, rows));
  let span = rows ? [data.plot.x[0], data.plot.x[rows - 1]] : [0, 1], now = span[0];
  const all = span.slice();

  function makePanel(parent, panel, count) {
    const canvas = document.createElement("canvas"), legend = document.createElement("div");
    legend.className = "legend";
    for (const curve of panel.curves) {
      const entry = document.createElement("span"), line = document.createElement("i");
      line.style.borderTopColor = curve.colour;
      line.style.borderTopStyle = curve.dash.length ? "dashed" : "solid";
      entry.append(line, curve.name);
      legend.append(entry);
    }
    parent.append(canvas, legend);
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", panel.label);
    canvas.title = "drag to zoom, double click to see all, click to go there";
    const found = { canvas, panel, ...unpack(panel.packed, count) };
    listen(found);
    return found;
  }
  function listen(one) {
    let from = null;
    const at = (event) => {
      const box = one.canvas.getBoundingClientRect(), [left, right] = edges(box.width);
      return span[0] + (event.clientX - box.left - left) / (right - left) * (span[1] - span[0]);
    };
    one.canvas.addEventListener("pointerdown", (event) => { from = at(event); one.canvas.setPointerCapture(event.pointerId); });
    one.canvas.addEventListener("pointerup", (event) => {
      if (from === null) return;
      const to = at(event), [low, high] = [Math.min(from, to), Math.max(from, to)];
      from = null;
      if (high - low < 0.01 * (span[1] - span[0])) { go(Math.min(all[1], Math.max(all[0], to))); return; }
      span = [Math.max(low, all[0]), Math.min(high, all[1])];
      show(now);
    });
    one.canvas.addEventListener("dblclick", () => { span = all.slice(); show(now); });
  }
  const edges = (width) => [62, width - 12];

  function ticks(low, high, most) {
    const rough = (high - low) / most, size = Math.pow(10, Math.floor(Math.log10(rough)));
    const step = [1, 2, 5, 10].map((f) => f * size).find((s) => s >= rough) || size;
    const found = [];
    for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k++) found.push(k * step);
    return found;
  }
  function told(x, step) {
    if (x === 0) return "0";
    const size = Math.abs(x);
    if (size >= 1e5 || size < 1e-3) return x.toExponential(1);
    return x.toFixed(Math.max(0, Math.min(6, -Math.floor(Math.log10(step || size)))));
  }
  function curves(one, to) {
    const { values, columns, panel } = one, x = data.plot.x;
    panel.curves.forEach((curve, c) => {
      const pen = one.pen;
      pen.beginPath();
      let down = false;
      for (let k = 0; k < rows; k++) {
        const y = values[k * columns + c];
        if (!(k + 1 < rows ? x[k + 1] >= span[0] : true) || (k > 0 && x[k - 1] > span[1]) || Number.isNaN(y)) { down = false; continue; }
        const [px, py] = to(x[k], y);
        if (down) pen.lineTo(px, py); else pen.moveTo(px, py);
        down = true;
      }
      pen.strokeStyle = curve.colour;
      pen.setLineDash(curve.dash);
      pen.lineWidth = 1.4;
      pen.stroke();
    });
    one.pen.setLineDash([]);
  }
  function paint(one, last) {
    const { canvas, panel } = one, ratio = window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const pen = one.pen = canvas.getContext("2d"), [left, right] = edges(width), top = 18, bottom = height - 22;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const [low, high] = panel.range, to = (x, y) => [
      left + (x - span[0]) / (span[1] - span[0] || 1) * (right - left),
      bottom - (y - low) / (high - low || 1) * (bottom - top),
    ];
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = "#444";
    pen.strokeStyle = "#e3e6ea";
    pen.lineWidth = 1;
    const across = ticks(span[0], span[1], Math.max(2, width / 110)), up = ticks(low, high, 4);
    pen.beginPath();
    for (const x of across) { const [px] = to(x, low); pen.moveTo(px, top); pen.lineTo(px, bottom); }
    for (const y of up) { const [, py] = to(span[0], y); pen.moveTo(left, py); pen.lineTo(right, py); }
    pen.stroke();
    pen.textAlign = "center";
    for (const x of across) {  // the last one is not cut off at the edge
      const text = told(x, across[1] - across[0]), half = pen.measureText(text).width / 2;
      pen.fillText(text, Math.min(to(x, low)[0], width - half - 1), bottom + 14);
    }
    pen.textAlign = "right";
    for (const y of up) pen.fillText(told(y, up[1] - up[0]), left - 5, to(span[0], y)[1] + 4);
    pen.textAlign = "left";
    pen.fillText(panel.label + (last ? "   over " + data.plot.across : ""), left, 12);
    pen.save();
    pen.beginPath();
    pen.rect(left, top, right - left, bottom - top);
    pen.clip();
    pen.strokeStyle = "#b9bfc6";
    for (const mark of data.plot.marks) { const [px] = to(mark, low); pen.beginPath(); pen.moveTo(px, top); pen.lineTo(px, bottom); pen.stroke(); }
    curves(one, to);
    pen.restore();
    one.image = null;
    return to;
  }
  let painted = "";
  function show(t) {
    now = t;
    const key = span.join() + "," + (panels[0] ? panels[0].canvas.clientWidth : 0);
    panels.forEach((one, k) => {
      [one.canvas.dataset.from, one.canvas.dataset.to] = span;
      if (key !== painted || !one.still) {
        const to = paint(one, k === panels.length - 1);
        if (!to) return;
        one.to = to;
        one.still = one.still || document.createElement("canvas");
        one.still.width = one.canvas.width;
        one.still.height = one.canvas.height;
        one.still.getContext("2d").drawImage(one.canvas, 0, 0);
      }
      const pen = one.canvas.getContext("2d"), ratio = window.devicePixelRatio || 1;
      pen.setTransform(1, 0, 0, 1, 0, 0);
      pen.clearRect(0, 0, one.canvas.width, one.canvas.height);
      pen.drawImage(one.still, 0, 0);
      if (t < span[0] || t > span[1] || !data.plot.clock) return;
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      const [low, high] = one.panel.range, [px, top] = one.to(t, high), [, bottom] = one.to(t, low);
      pen.strokeStyle = "#c2410c";
      pen.beginPath();
      pen.moveTo(px, top);
      pen.lineTo(px, bottom);
      pen.stroke();
    });
    painted = key;
  }
  return { show, resize: () => { painted = ""; } };
}
