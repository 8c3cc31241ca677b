/**
 * The only loop of the page besides the renderer's own: it runs while something moves and stops when nothing does, so that a
 * page at rest costs nothing. Flight and transitions of the camera hang on it.
 */

/** A step of a movement: seconds since the step before; it says whether there is more to come. @typedef {(seconds: number) => boolean} Task */

export class Ticker {
    /** @type {Set<Task>} */
    #tasks = new Set();
    #last = 0;
    #running = false;

    /** Calls `task` in every frame until it returns false. One that already runs goes on. @param {Task} task */
    add(task) {
        this.#tasks.add(task);
        if (this.#running) return;
        this.#running = true;
        this.#last = performance.now();
        requestAnimationFrame(this.#tick);
    }

    /** @param {Task} task */
    remove(task) {
        this.#tasks.delete(task);
    }

    #tick = () => {
        const now = performance.now();
        // After a pause (another tab, a long frame) a step of its true length would fly through walls.
        const seconds = Math.min((now - this.#last) / 1000, 0.1);
        this.#last = now;
        for (const task of [...this.#tasks]) {
            if (this.#tasks.has(task) && !task(seconds)) this.#tasks.delete(task);
        }
        this.#running = this.#tasks.size > 0;
        if (this.#running) requestAnimationFrame(this.#tick);
    };
}
