/**
 * How far the solve is: state, bar and figures. Without a solver behind the page it says what the light was made with.
 */

import { announce, element } from "twinray/announce.js";
import { count, duration, percent } from "twinray/colours.js";

/** @import { Status, Walk } from "twinray/types.js" */

const STATES = { solving: "Solving", paused: "Paused", finished: "Finished", lost: "Connection lost" };

/** @type {Status["state"] | null} */
let shownState = null;

/** The light of an exported page, which stays as it is. @param {Walk} walk */
export function showStored(walk) {
    element("solve").dataset.state = "finished";
    element("solve-state").textContent = "Solved";
    element("solve-rays").textContent = count(walk.stats.rays);
    element("solve-error").textContent = percent(walk.stats.error);
    element("solve-brief").textContent = Number.isFinite(walk.stats.error) ? `error ${percent(walk.stats.error)}` : "";
    for (const id of ["solve-rate", "solve-time"]) element(id).parentElement?.remove();
}

/** @param {Status} status */
export function showStatus(status) {
    const { state, rays, rate, error, seconds, message } = status;
    element("solve").dataset.state = state;
    element("solve-state").textContent = STATES[state];
    element("solve-rays").textContent = count(rays);
    element("solve-rate").textContent = state === "solving" ? count(rate) : "–";
    element("solve-error").textContent = percent(error);
    element("solve-time").textContent = duration(seconds);

    const share = state === "finished" ? 1 : done(status);
    const left = state === "solving" && share !== null && share > 0.02 ? (seconds * (1 - share)) / share : NaN;
    const goal = goalText(status.goal);
    const brief = [Number.isFinite(error) ? `error ${percent(error)}` : `${count(rays)} rays`];
    if (left > 0) brief.push(`${duration(left)} left`);
    element("solve-brief").textContent = brief.join(" · ");

    const words =
        message ?? (left > 0 ? `About ${duration(left)} to ${goal}` : goal && state !== "finished" ? `To ${goal}` : "");
    element("solve-message").textContent = words;
    element("solve-message").hidden = words === "";

    const bar = element("solve-bar");
    bar.hidden = share === null;
    if (share !== null) {
        bar.setAttribute("aria-valuenow", String(Math.round(100 * share)));
        bar.setAttribute("aria-valuetext", `${Math.round(100 * share)} percent, ${STATES[state].toLowerCase()}`);
        element("solve-fill").style.transform = `scaleX(${share})`;
    }

    const button = /** @type {HTMLButtonElement} */ (element("solve-toggle"));
    button.hidden = state === "finished" || state === "lost";
    button.textContent = state === "paused" ? "Resume" : "Pause";

    if (shownState !== null && shownState !== state) announce(message ? `${STATES[state]}. ${message}` : STATES[state]);
    shownState = state;
}

/**
 * The share of the work that is done, by rays; null where there is no end. An error falls with the root of the rays, so that
 * half of it is a quarter of the way.
 * @param {Status} status
 */
export function done({ goal, rays, error, seconds }) {
    if (goal === null) return null;
    let share;
    if ("rays" in goal) share = rays / goal.rays;
    else if ("error" in goal) share = (goal.error / error) ** 2;
    else share = seconds / goal.seconds;
    return Number.isFinite(share) ? Math.min(Math.max(share, 0), 1) : 0;
}

/** @param {Status["goal"]} goal */
function goalText(goal) {
    if (goal === null) return "";
    if ("seconds" in goal) return `${count(goal.seconds)} seconds`;
    return "rays" in goal ? `${count(goal.rays)} rays` : `an error of ${percent(goal.error)}`;
}
