// A web server for tests, on a port of its own, that can be as bad as real ones. It serves the files of folders under
// their names, later folders behind earlier ones. What the query of a request asks for:
//
//   mode=ranges     (default) answers ranges
//   mode=plain      answers every request with the whole file
//   mode=longer     sends more bytes than the range has
//   mode=shorter    sends half of the bytes of each range, and says so in Content-Length alone
//   mode=elsewhere  states another range than was asked for
//   mode=other      sends bytes of another place
//   mode=changing   has another ETag for each answer
//   mode=replaced   answers the first range, and then every request with a page of HTML
//   mode=gzip       compresses every answer (Content-Encoding), and answers no ranges
//   hidden=1        Content-Range and ETag are left out, as if CORS hid them
//   flip=N          byte N of the file is damaged
//   cut=N           the file ends after N bytes
//   drop=N          the first answer with a body ends after N bytes, and its connection with it
//   rate=N          bytes a second;  delay=MS  before an answer
//   stall=N         answers wait after N bytes while `stalled`
//   status=N        answers with this status
//   type=TEXT       states this media type
//   closed=1        no other site may read the answer
//
// `server.faults`: Map from a path to statuses that answer the next requests for it; 0: an answer never comes.
import { createServer } from "node:http";
import { readFileSync, statSync } from "node:fs";
import { extname, join, normalize } from "node:path";
import { gzipSync } from "node:zlib";
import { setTimeout as sleep } from "node:timers/promises";

const TYPES = {
    ".html": "text/html",
    ".js": "text/javascript",
    ".mjs": "text/javascript",
    ".wasm": "application/wasm",
    ".css": "text/css",
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".svg": "image/svg+xml",
    ".pbvg": "model/vnd.pbm.pbvg",
};

// `isolated`: with the headers that allow threads. The result has `url`, `log` ([{path, range, status, sent}]), `down`
// (true: every connection is broken), `stalled` (true: answers with stall=N wait), `policy` (Content-Security-Policy of all
// answers), `rate` (bytes a second of answers that ask for no other) and close().
export async function startServer(folders, { isolated = false } = {}) {
    const server = { log: [], down: false, stalled: false, isolated, policy: null, rate: 0, faults: new Map() };
    const contents = new Map(); // of files, by name
    const dropped = new Set();
    const sockets = new Set();
    const http = createServer(async (request, response) => {
        const { pathname, search, searchParams } = new URL(request.url, "http://server");
        if (server.down) return request.socket.destroy();
        const file = folders.map((folder) => join(folder, normalize(pathname))).find((name) => isFile(name));
        const entry = { path: pathname, range: request.headers.range ?? null, status: 404, sent: 0 };
        server.log.push(entry);
        if (searchParams.has("delay")) await sleep(+searchParams.get("delay"));
        const fault = server.faults.get(pathname)?.shift();
        if (fault === 0) return;
        const status = fault ?? +(searchParams.get("status") ?? 0);
        if (!file || status) return finish(response, entry, status || 404, {}, Buffer.alloc(0));
        const { mtimeMs } = statSync(file);
        if (contents.get(file)?.mtimeMs !== mtimeMs) contents.set(file, { mtimeMs, bytes: readFileSync(file) });
        let { bytes } = contents.get(file);
        if (searchParams.has("flip")) {
            bytes = Buffer.from(bytes);
            bytes[+searchParams.get("flip")] ^= 0x10;
        }
        if (searchParams.has("cut")) bytes = bytes.subarray(0, +searchParams.get("cut"));
        const isFirst = server.log.filter((other) => other.path === pathname).length === 1;
        const answer = answerOf(bytes, request.headers.range, searchParams.get("mode") ?? "ranges", isFirst);
        const headers = {
            "Content-Type": TYPES[extname(file)] ?? "application/octet-stream",
            "Cache-Control": "no-store",
            "Access-Control-Allow-Origin": "*",
            ETag: `"${searchParams.get("mode") === "changing" ? server.log.length : 1}"`,
            ...answer.headers,
        };
        if (searchParams.has("type")) headers["Content-Type"] = searchParams.get("type");
        if (searchParams.has("closed")) delete headers["Access-Control-Allow-Origin"];
        if (server.policy) headers["Content-Security-Policy"] = server.policy;
        if (searchParams.get("hidden")) for (const name of ["Content-Range", "ETag"]) delete headers[name];
        if (server.isolated)
            Object.assign(headers, {
                "Cross-Origin-Opener-Policy": "same-origin",
                "Cross-Origin-Embedder-Policy": "require-corp",
                "Cross-Origin-Resource-Policy": "same-origin",
            });
        const drop = searchParams.has("drop") && !dropped.has(pathname + search) ? +searchParams.get("drop") : null;
        if (drop !== null) dropped.add(pathname + search);
        await finish(response, entry, answer.status, headers, answer.body, {
            drop,
            rate: +(searchParams.get("rate") ?? server.rate),
            stall: +(searchParams.get("stall") ?? Infinity),
        });
    });
    async function finish(response, entry, status, headers, body, { drop = null, rate = 0, stall = Infinity } = {}) {
        entry.status = status;
        response.writeHead(status, { "Content-Length": body.length, ...headers });
        const step = rate ? Math.max(1024, Math.round(rate / 50)) : 65536;
        for (let at = 0; at < body.length && !response.destroyed; at += step) {
            const part = body.subarray(at, Math.min(at + step, drop ?? body.length));
            if (part.length > 0) response.write(part);
            entry.sent += part.length;
            while (server.stalled && entry.sent >= stall && !response.destroyed) await sleep(50);
            if (server.down || (drop !== null && at + step >= drop)) {
                await sleep(20);
                return response.destroy();
            }
            if (rate) await sleep((part.length / rate) * 1000);
        }
        response.end();
    }
    http.on("connection", (socket) => {
        sockets.add(socket);
        socket.on("close", () => sockets.delete(socket));
    });
    await new Promise((resolve) => http.listen(0, "127.0.0.1", resolve));
    server.url = `http://127.0.0.1:${http.address().port}`;
    server.breakConnections = () => sockets.forEach((socket) => socket.destroy());
    server.close = () => {
        http.close();
        server.breakConnections();
    };
    return server;
}

function isFile(name) {
    return statSync(name, { throwIfNoEntry: false })?.isFile() ?? false;
}

function answerOf(bytes, range, mode, isFirst) {
    if (mode === "replaced" && !isFirst) return { status: 200, headers: {}, body: Buffer.from("<h1>Log in</h1>") };
    const size = bytes.length;
    if (mode === "gzip") return { status: 200, headers: { "Content-Encoding": "gzip" }, body: gzipSync(bytes) };
    const parts = mode === "plain" ? null : /^bytes=(\d+)-(\d*)$/.exec(range ?? "");
    if (!parts) return { status: 200, headers: mode === "plain" ? {} : { "Accept-Ranges": "bytes" }, body: bytes };
    const from = +parts[1];
    if (from >= size) return { status: 416, headers: { "Content-Range": `bytes */${size}` }, body: Buffer.alloc(0) };
    const to = Math.min(parts[2] === "" ? size : +parts[2] + 1, size);
    const stated = mode === "elsewhere" ? from + 1 : from;
    const headers = { "Content-Range": `bytes ${stated}-${to - 1}/${size}` };
    let body = bytes.subarray(from, to);
    if (mode === "longer") body = Buffer.concat([body, Buffer.alloc(100)]);
    if (mode === "shorter") body = body.subarray(0, Math.ceil(body.length / 2));
    if (mode === "other" && from > 0) body = bytes.subarray(0, to - from);
    return { status: 206, headers, body };
}
