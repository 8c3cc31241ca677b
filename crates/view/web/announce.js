/**
 * What the page says: short notes that everyone sees for a moment, and words for screen readers only.
 */

const SHOWN_MILLISECONDS = 2500;

/** @type {ReturnType<typeof setTimeout> | undefined} */
let timer;

/** The element of this id, which the page is known to have. @param {string} id @returns {HTMLElement} */
export function element(id) {
    const found = document.getElementById(id);
    if (!found) throw new Error(`the page has no element "${id}"`);
    return found;
}

/** A note that goes away by itself, read aloud too. @param {string} text @param {number} [milliseconds] */
export function toast(text, milliseconds = SHOWN_MILLISECONDS) {
    const note = element("toast");
    note.textContent = text;
    note.dataset.shown = "true";
    clearTimeout(timer);
    timer = setTimeout(() => {
        delete note.dataset.shown;
        // A live region speaks again only if its text has changed in between.
        note.textContent = "";
    }, milliseconds);
}

/** For screen readers only: what others see at its place in the picture. @param {string} text */
export function announce(text) {
    const region = element("announcer");
    region.textContent = "";
    setTimeout(() => (region.textContent = text), 50);
}
