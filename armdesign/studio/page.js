// What the page does by itself: a file dropped anywhere goes to the button for files of the open panel, a click in a
// plot goes to that moment, a link to a panel opens it, viser's notes on slow drawing and on uploads of another page go away,
// and where the window is high enough headline, plot and tabs stay in sight while the panel below them scrolls by itself.
(() => {
  const notes = () => [...document.querySelectorAll(".mantine-Notification-root")];
  const idle = (each) => /^(Software WebGL|Uploading undefined)/.test(each.textContent);
  setInterval(() => notes().filter(idle).forEach((each) => each.querySelector("button").click()), 1000);
  const LEAST = 250; // height of a panel that is worth scrolling by itself [pixels]
  setInterval(() => {
    const tabs = document.querySelector("[role=tablist]"), view = tabs?.closest(".mantine-ScrollArea-viewport");
    if (!view) return;
    const top = tabs.getBoundingClientRect().bottom - view.getBoundingClientRect().top + view.scrollTop;
    const room = Math.floor(view.clientHeight - top) - 8, style = tabs.nextElementSibling.style;
    style.maxHeight = room < LEAST ? "" : `${room}px`;
    style.overflowY = room < LEAST ? "" : "auto";
  }, 300);
  const shown = (each) => each.parentElement.querySelector("button")?.offsetParent;
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    event.preventDefault();
    const input = [...document.querySelectorAll("input[type=file]")].find(shown);
    if (!input || !event.dataTransfer.files.length) return;
    input.files = event.dataTransfer.files;
    input.dispatchEvent(new Event("change", { bubbles: true }));
  });
  const typed = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value");
  const goTo = (time) => {
    const slider = document.querySelector("[role=slider]"); // the timeline is the first on the page
    const input = slider?.closest("[id]")?.parentElement?.querySelector("input:not([type=hidden])");
    if (!input) return;
    typed.set.call(input, time.toFixed(2));
    input.dispatchEvent(new Event("input", { bubbles: true }));
  };
  addEventListener("click", (event) => {
    const plot = event.target.closest("svg[data-start]");
    if (plot) {
      const box = plot.getBoundingClientRect(), { start, end, left, right, width } = plot.dataset;
      const x = ((event.clientX - box.left) / box.width) * width;
      const share = Math.min(Math.max((x - left) / (right - left), 0), 1);
      goTo(Number(start) + share * (end - start));
    }
    const panel = event.target.closest("[data-panel]")?.dataset.panel;
    if (!panel) return;
    event.preventDefault();
    const tab = [...document.querySelectorAll("[role=tab]")].find((each) => each.textContent.trim() === panel);
    tab?.dispatchEvent(new KeyboardEvent("keydown", { key: "Enter", bubbles: true })); // deaf to click()
    tab?.focus();
    setTimeout(() => document.querySelector("[role=tablist]")?.nextElementSibling.scrollTo(0, 0), 100);
  });
})();
