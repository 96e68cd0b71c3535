/*
 * Checks of the layout, for any width, in light and in dark mode.
 */

/** Returns the faults of the layout in words. Runs in the page. */
export const faults = () => {
  const said = [];
  const root = document.documentElement;
  if (root.scrollWidth > root.clientWidth) said.push(`the page is ${root.scrollWidth} px wide, the window ${root.clientWidth}`);
  const named = (element) => (element.textContent || "").trim().slice(0, 40);
  for (const details of document.querySelectorAll("details")) details.open = true;
  for (const cell of document.querySelectorAll("td, th, p, li, dd, h1, h2, button, figcaption")) {
    if (!cell.getClientRects().length) continue;
    if (cell.scrollWidth > cell.clientWidth + 1 && getComputedStyle(cell).display !== "inline") said.push(`clipped: ${named(cell)}`);
  }
  // tables may scroll in a frame, but the text of a figure must fit into the figure
  for (const drawing of document.querySelectorAll("figure svg")) {
    if (!drawing.getClientRects().length) continue;
    const frame = drawing.getBoundingClientRect();
    const texts = [...drawing.querySelectorAll("text")].map((t) => ({ t, r: t.getBoundingClientRect() }));
    for (const { t, r } of texts) {
      if (r.left < frame.left - 2 || r.right > frame.right + 2) said.push(`beyond its figure: ${named(t)} (${drawing.getAttribute("aria-label")?.slice(0, 40)})`);
    }
    for (let i = 0; i < texts.length; i += 1) {
      for (let k = i + 1; k < texts.length; k += 1) {
        const [a, b] = [texts[i].r, texts[k].r];
        const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
        const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
        if (across > 2 && down > 5) said.push(`overlap: ${named(texts[i].t)} | ${named(texts[k].t)} (${drawing.getAttribute("aria-label")?.slice(0, 40)})`);
      }
    }
  }
  // text that covers points is illegible: test a grid of positions under each text
  for (const drawing of document.querySelectorAll("figure svg")) {
    if (!drawing.getClientRects().length) continue;
    const clouds = [...drawing.querySelectorAll("path.dots")];
    const inverse = drawing.getScreenCTM()?.inverse();
    if (!clouds.length || !inverse) continue;
    for (const word of drawing.querySelectorAll("text")) {
      const r = word.getBoundingClientRect();
      const places = [0.1, 0.3, 0.5, 0.7, 0.9].flatMap((u) => [0.3, 0.5, 0.7].map((v) => new DOMPoint(r.left + u * r.width, r.top + v * r.height)));
      const on = places.some((place) => clouds.some((cloud) => cloud.isPointInStroke(place.matrixTransform(inverse))));
      if (on) said.push(`on points: ${named(word)} (${drawing.getAttribute("aria-label")?.slice(0, 40)})`);
    }
  }
  const part = (c) => { const v = c / 255; return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; };
  const light = (color) => {
    const [r, g, b] = color.match(/[\d.]+/g).map(Number);
    return 0.2126 * part(r) + 0.7152 * part(g) + 0.0722 * part(b);
  };
  const behind = (element) => {
    for (let e = element; e; e = e.parentElement) {
      const color = getComputedStyle(e).backgroundColor;
      if (!/rgba\(.*, 0\)|transparent/.test(color)) return color;
    }
    return "rgb(255, 255, 255)";
  };
  for (const element of document.querySelectorAll("p, td, th, li, dd, dt, h1, h2, button, summary, figcaption, svg text")) {
    if (!element.getClientRects().length) continue;
    const style = getComputedStyle(element);
    const [a, b] = [light(element instanceof SVGElement ? style.fill : style.color), light(behind(element))];
    const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (contrast < 4.5) said.push(`contrast ${contrast.toFixed(1)}: ${named(element)}`);
  }
  return [...new Set(said)];
};
