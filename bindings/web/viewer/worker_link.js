// The page's end of a worker of the viewer (view_worker.js). It starts the worker, and meanwhile fetches what the worker
// needs: the code of the renderer, once for all viewers of a page, and the first bytes of the model.
import { platform, threadsOf } from "../module/platform.js";
import { trusted } from "./addresses.js";
import { FIRST_BYTES, forwardAnswer } from "./answers.js";

// Literal addresses, by which bundlers find the files. None is a module of the page: bundlers copy them as they are.
const FILES = {
    "view_worker.js": new URL("./view_worker.js", import.meta.url),
    "pbm.wasm": new URL("./pbm.wasm", import.meta.url),
    "pbm_threads.js": new URL("./pbm_threads.js", import.meta.url),
    "pbm_threads.wasm": new URL("./pbm_threads.wasm", import.meta.url),
    "pbm_threads.worker.js": new URL("./pbm_threads.worker.js", import.meta.url),
};

// The renderer, compiled, and how much of it is here.
const code = { module: null, bytes: 0, listeners: new Set() };

function compiled(name) {
    code.module ??= platform
        .compile(FILES[name], (bytes) => {
            code.bytes = bytes;
            for (const hear of code.listeners) hear();
        })
        .catch((error) => {
            code.module = null;
            throw error;
        });
    return code.module;
}

// Threads that draw. Bundlers that put small files into others make threads impossible: memory is not shared with what
// comes from a data: address.
function threadsHere() {
    return FILES["pbm_threads.worker.js"].protocol === "data:" ? 1 : threadsOf("auto");
}

function newWorker() {
    const file = FILES["view_worker.js"];
    if (file.origin === self.origin) return new Worker(trusted(file), { type: "module" });
    // A worker's own file must come from the origin of the page; what it imports need not. It is no module: browsers start
    // none in a frame without an origin. Messages wait until the import is done.
    const text = `const early = [];
        self.onmessage = (event) => early.push(event);
        import(${JSON.stringify(file.href)}).then(
            () => early.forEach((event) => self.onmessage(event)),
            (error) => setTimeout(() => { throw error; }),
        );`;
    const address = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
    return new Worker(trusted(address));
}

// What an error of the renderer's code is to people: see texts.js.
function codeError({ message }) {
    const isForbidden = /Content Security Policy|unsafe-eval|disallowed by embedder/.test(message);
    return { name: "module", key: isForbidden ? "noWebAssembly" : "code", values: { reason: message } };
}

export class WorkerLink {
    #worker;
    #end = new AbortController();
    #answers = new Map(); // id -> resolve
    #asked = 0;

    // `start`: {canvas, url, blob, maxMemory}. `listener` has message(data), failed(event): the worker cannot run, and
    // codeArrived(): more of the renderer is here. Throws whatever the browser has against a worker.
    constructor({ canvas, ...start }, listener) {
        this.#worker = newWorker();
        this.#worker.onmessage = ({ data: { type, ...message } }) => {
            if (type === "answer") this.#settle(message);
            else if (type === "enough") this.#end.abort();
            else listener.message(type, message);
        };
        this.#worker.onerror = (event) => listener.failed(event);
        const threads = threadsHere();
        this.post({ type: "start", canvas, threads, ...start }, canvas ? [canvas] : []);
        const wasm = threads > 1 ? "pbm_threads.wasm" : "pbm.wasm";
        const files = Object.fromEntries(Object.entries(FILES).map(([name, url]) => [name, url.href]));
        this.hear = () => listener.codeArrived();
        code.listeners.add(this.hear);
        compiled(wasm).then(
            (module) => this.post({ type: "code", files: { ...files, [wasm]: module } }),
            (error) => this.post({ type: "code", error: codeError(error) }),
        );
        if (start.url) forwardAnswer(start.url, FIRST_BYTES, (...message) => this.post(...message), this.#end.signal);
    }

    // Bytes of the renderer that have arrived.
    get codeBytes() {
        return code.bytes;
    }

    post(message, transfer = []) {
        this.#worker?.postMessage(message, transfer);
    }

    // The worker's answer; null if it ends before.
    ask(question, parameters = {}) {
        if (!this.#worker) return Promise.resolve(null);
        const id = ++this.#asked;
        this.post({ type: "ask", id, question, ...parameters });
        return new Promise((resolve) => this.#answers.set(id, resolve));
    }

    #settle({ id, value }) {
        this.#answers.get(id)?.(value);
        this.#answers.delete(id);
    }

    close() {
        if (!this.#worker) return;
        this.#worker.onmessage = this.#worker.onerror = null;
        this.#worker.terminate();
        this.#worker = null;
        this.#end.abort();
        code.listeners.delete(this.hear);
        for (const resolve of this.#answers.values()) resolve(null);
        this.#answers.clear();
    }
}
