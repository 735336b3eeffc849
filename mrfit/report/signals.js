for (const box of document.querySelectorAll(".series")) {
  const seconds = Number(box.dataset.seconds), across = Number(box.dataset.across);
  const views = [...box.querySelectorAll("svg")], axis = box.querySelector(".axis");
  const height = views[0].viewBox.baseVal.height;
  let from = 0, to = seconds;
  const show = (a, b) => {
    const width = Math.min(Math.max(b - a, seconds / 2000), seconds);
    from = Math.min(Math.max((a + b - width) / 2, 0), seconds - width);
    to = from + width;
    for (const view of views) view.setAttribute("viewBox", `${from / seconds * across} 0 ${width / seconds * across} ${height}`);
    const rough = width / 6, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map(k => k * power).find(k => k >= rough);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    axis.replaceChildren();
    for (let k = Math.ceil(from / step - 1e-9); k * step <= to + 1e-9 * step; k++) {
      const tick = document.createElement("span");
      tick.textContent = (k * step).toFixed(digits) + " s";
      tick.style.left = `${(k * step - from) / width * 100}%`;
      axis.append(tick);
    }
  };
  const timeAt = event => {
    const frame = views[0].getBoundingClientRect();
    return from + Math.min(Math.max((event.clientX - frame.left) / frame.width, 0), 1) * (to - from);
  };
  const buttons = { "+": [.25, .75], "−": [-.5, 1.5], "◀": [-.5, .5], "▶": [.5, 1.5], all: null };
  const words = { "+": "zoom in", "−": "zoom out", "◀": "earlier", "▶": "later", all: "whole log" };
  for (const [text, shares] of Object.entries(buttons)) {
    const button = document.createElement("button");
    button.textContent = text;
    button.title = words[text];
    button.onclick = () => shares ? show(...shares.map(share => from + share * (to - from))) : show(0, seconds);
    box.querySelector(".buttons").append(button);
  }
  let begin = null;
  for (const view of views) {
    view.onpointerdown = event => { if (event.pointerType !== "touch") { begin = timeAt(event); view.setPointerCapture(event.pointerId); } };
    view.onpointerup = event => {
      const end = timeAt(event);
      if (begin !== null && Math.abs(end - begin) > (to - from) / 100) show(Math.min(begin, end), Math.max(begin, end));
      begin = null;
    };
    view.ondblclick = () => show(0, seconds);
  }
  const cell = (row, label) => row.querySelector(`td[data-label="${label}"]`)?.textContent.replace("−", "-");
  for (const row of box.closest("section").nextElementSibling?.querySelectorAll("tbody tr") ?? []) {
    const [a, b, at] = ["from (s)", "to (s)", "at (s)"].map(label => parseFloat(cell(row, label)));
    const range = Number.isFinite(a) ? [a, b] : Number.isFinite(at) ? [at - seconds / 100, at + seconds / 100] : null;
    if (!range) continue;
    row.classList.add("zooms");
    row.onclick = () => { show(...range); box.scrollIntoView({ block: "center" }); };
  }
  show(0, seconds);
}
