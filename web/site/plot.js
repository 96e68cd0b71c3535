/*
 * Draws lines over time on a canvas, in panels one above the other, in the colours of the page.
 */

/** @typedef {{name: string, ink: string, x: ArrayLike<number>, y: ArrayLike<number>}} Line */

const plot = {
  /** @param {number} span Returns a round step for the axis: 1, 2 or 5 times a power of ten. */
  step(span) {
    const rough = span / 4;
    const ten = 10 ** Math.floor(Math.log10(rough));
    return [1, 2, 5, 10].map((k) => k * ten).find((s) => s >= rough) ?? 10 * ten;
  },

  /** @param {ArrayLike<number>} values */
  extent(values) {
    let [least, greatest] = [Infinity, -Infinity];
    for (let i = 0; i < values.length; i += 1) {
      if (values[i] < least) least = values[i];
      if (values[i] > greatest) greatest = values[i];
    }
    return least <= greatest ? [least, greatest] : [0, 1];
  },

  /** @param {HTMLCanvasElement} canvas @param {Line[]} lines Draws each line in a separate panel. */
  draw(canvas, lines) {
    const [width, height, scale] = [canvas.clientWidth, canvas.clientHeight, window.devicePixelRatio || 1];
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
    const pen = canvas.getContext("2d");
    if (!pen || !width) return;
    const style = getComputedStyle(document.documentElement);
    const ink = (/** @type {string} */ name) => style.getPropertyValue(`--${name}`).trim();
    pen.scale(scale, scale);
    pen.font = `12px ${getComputedStyle(document.body).fontFamily}`;
    const [left, right, foot] = [56, 10, 30];
    const each = (height - foot) / Math.max(lines.length, 1);
    const all = lines.map((line) => plot.extent(line.x));
    const [from, to] = [Math.min(...all.map((e) => e[0])), Math.max(...all.map((e) => e[1]))];
    const across = (/** @type {number} */ x) => left + ((x - from) / (to - from || 1)) * (width - left - right);
    const level = (/** @type {number} */ x0, /** @type {number} */ x1, /** @type {number} */ y) => {
      pen.beginPath();
      pen.moveTo(x0, y);
      pen.lineTo(x1, y);
      pen.stroke();
    };
    lines.forEach((line, panel) => {
      const [least, greatest] = plot.extent(line.y);
      const [top, bottom] = [panel * each + 20, (panel + 1) * each - 4];
      const down = (/** @type {number} */ y) => bottom - ((y - least) / (greatest - least || 1)) * (bottom - top);
      pen.fillStyle = ink("text");
      pen.textAlign = "left";
      pen.fillText(line.name, left, top - 7);
      const step = plot.step(greatest - least || 1);
      pen.textAlign = "right";
      for (let y = Math.ceil(least / step) * step; y <= greatest; y += step) {
        pen.strokeStyle = ink("grid");
        level(left, width - right, down(y));
        pen.fillText(String(Number(y.toPrecision(6))), left - 6, down(y) + 4);
      }
      pen.strokeStyle = ink(line.ink);
      pen.lineWidth = 1.5;
      pen.beginPath();
      let isDown = false;
      for (let i = 0; i < line.x.length; i += 1) {
        const isThere = Number.isFinite(line.y[i]);
        if (isThere && isDown) pen.lineTo(across(line.x[i]), down(line.y[i]));
        else if (isThere) pen.moveTo(across(line.x[i]), down(line.y[i]));
        isDown = isThere;
      }
      pen.stroke();
      pen.lineWidth = 1;
    });
    pen.fillStyle = ink("text");
    const step = plot.step(to - from || 1);
    for (let x = Math.ceil(from / step) * step; x <= to; x += step) {
      pen.textAlign = across(x) > width - 40 ? "right" : "center";
      pen.fillText(`${Number(x.toPrecision(6))} s`, across(x), height - 8);
    }
  },
};
