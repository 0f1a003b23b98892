// The contrast of all text with its background, as WCAG 2 defines it: 4.5 is its level AA.
leave(() => {
  all("details").forEach(details => { details.open = true; });
  document.documentElement.style.scrollBehavior = "auto";
  const first = document.querySelector(".timeline");
  if (first) first.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
  const context = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  // Any colour as red, green, blue and opacity.
  const known = new Map();
  function rgba(colour) {
    if (!known.has(colour)) {
      context.clearRect(0, 0, 1, 1);
      context.fillStyle = "#000";
      context.fillStyle = colour;
      context.fillRect(0, 0, 1, 1);
      const [r, g, b, a] = context.getImageData(0, 0, 1, 1).data;
      known.set(colour, colour === "none" ? [0, 0, 0, 0] : [r, g, b, a / 255]);
    }
    return known.get(colour);
  }
  const over = (top, opacity, below) => {
    const a = top[3] * opacity;
    return [0, 1, 2].map(n => top[n] * a + below[n] * (1 - a)).concat(1);
  };
  const opacityOf = element => {
    let opacity = 1;
    for (let at = element; at && at.nodeType === 1; at = at.parentNode) { opacity *= Number(getComputedStyle(at).opacity); }
    return opacity;
  };
  const luminance = colour => colour.slice(0, 3)
    .map(value => { const share = value / 255; return share <= 0.04045 ? share / 12.92 : Math.pow((share + 0.055) / 1.055, 2.4); })
    .reduce((sum, value, n) => sum + value * [0.2126, 0.7152, 0.0722][n], 0);
  const contrast = (a, b) => {
    const [dark, light] = [luminance(a), luminance(b)].sort((x, y) => x - y);
    return (light + 0.05) / (dark + 0.05);
  };
  const canvasColour = rgba(getComputedStyle(document.body).backgroundColor);
  // What lies under a point, from the bottom up, without the text itself.
  function background(text, x, y) {
    let colour = canvasColour;
    for (const element of document.elementsFromPoint(x, y).reverse()) {
      if (text === element || text.contains(element)) {
        if (text === element && !(element instanceof SVGElement)) {
          colour = over(rgba(getComputedStyle(element).backgroundColor), 1, colour);
        }
        continue;
      }
      const style = getComputedStyle(element);
      if (!(element instanceof SVGElement) || element.tagName === "svg") {
        colour = over(rgba(style.backgroundColor), opacityOf(element), colour);
      } else if (element.tagName === "rect") {
        colour = over(rgba(style.fill), Number(style.fillOpacity) * opacityOf(element), colour);
      }
    }
    return colour;
  }
  const low = [];
  let measured = 0;
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const texts = [];
  while (walker.nextNode()) {
    const element = walker.currentNode.parentElement;
    if (walker.currentNode.data.trim() && !element.closest("script, noscript, option, #tip, #findings, [hidden]")) {
      texts.push([walker.currentNode, element]);
    }
  }
  texts.forEach(([node, element]) => {
    const style = getComputedStyle(element);
    if (style.visibility === "hidden" || element.disabled) { return; }
    const range = document.createRange();
    range.selectNodeContents(node);
    let box = range.getClientRects()[0];
    if (!box || box.width < 1 || box.height < 1) { return; }
    if (box.top < 0 || box.bottom > innerHeight) {
      scrollBy(0, box.top - innerHeight / 2);
      box = range.getClientRects()[0];
    }
    const [x, y] = [Math.min(box.left + box.width / 2, innerWidth - 2), box.top + box.height / 2];
    // Rows that a table has scrolled away are read when they come into view.
    const view = element.closest(".viewport, .scroll");
    if (view) {
      const frame = view.getBoundingClientRect();
      if (y < frame.top || y > frame.bottom || x < frame.left || x > frame.right) { return; }
    }
    measured += 1;
    const behind = background(element, x, y);
    const svg = element instanceof SVGElement;
    const colour = over(rgba(svg ? style.fill : style.color), opacityOf(element) * (svg ? Number(style.fillOpacity) : 1), behind);
    const found = contrast(colour, behind);
    if (found < 4.5) {
      low.push({ text: node.data.trim().slice(0, 40), class: String(element.getAttribute("class")), tag: element.tagName, contrast: Number(found.toFixed(2)), colour, behind });
    }
  });
  return { measured, low: low.slice(0, 20), dark: luminance(canvasColour) < 0.2 };
});
