/**
 * Where the panel is: beside the picture, or in a narrow window a sheet at its bottom that opens and closes.
 */

import { element } from "twinray/announce.js";

/** As in `style.css`. */
const NARROW = "(width < 760px) and (orientation: portrait), (width < 500px)";
/** A swipe of the sheet's head, in pixels. */
const SWIPE = 24;

export function setUpSheet() {
    element("sheet-toggle").addEventListener("click", () => setSheet(document.body.dataset.sheet !== "open"));
    const head = element("panel-head");
    let start = NaN;
    head.addEventListener("pointerdown", (event) => (start = event.clientY));
    head.addEventListener("pointerup", (event) => {
        const up = start - event.clientY;
        if (Math.abs(up) > SWIPE && matchMedia(NARROW).matches) setSheet(up > 0);
    });
    setSheet(false);
    // A telephone on its side: half of so small a picture is too much for a panel that nobody asked for.
    if (matchMedia("(width < 760px)").matches && !matchMedia(NARROW).matches) togglePanel();
}

/** Shows or hides the controls, in the way of this window. */
export function togglePanel() {
    if (matchMedia(NARROW).matches) return setSheet(document.body.dataset.sheet !== "open");
    const open = document.body.dataset.panel === "closed";
    document.body.dataset.panel = open ? "open" : "closed";
    element("tool-panel").setAttribute("aria-expanded", String(open));
}

/** @param {boolean} open */
function setSheet(open) {
    document.body.dataset.sheet = open ? "open" : "closed";
    const button = element("sheet-toggle");
    button.setAttribute("aria-expanded", String(open));
    button.setAttribute("aria-label", open ? "Hide the controls" : "Show the controls");
}
