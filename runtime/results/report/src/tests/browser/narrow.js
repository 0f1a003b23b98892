// What is wider than the screen and does not scroll by itself, and how tall the rows of the front are.
leave(() => {
  const beyond = all("main *, header *, .briefing *").filter(element => {
    if (element.closest(".scroll, .viewport, svg, pre")) { return false; }
    return element.getBoundingClientRect().right > document.documentElement.clientWidth + 1;
  });
  const heights = all("#front tbody tr").map(row => row.getBoundingClientRect().height);
  return { width: innerWidth, beyond: beyond.slice(0, 5).map(element => element.outerHTML.slice(0, 200)), tallest: Math.max(0, ...heights) };
});
