// Addresses: what of them may be shown, and which of them no request can reach.

const LONGEST = 60; // characters of a name

// The name of a file for people: without folders, and without the query, which may hold a token.
export function fileName(url) {
    let name;
    try {
        const { protocol, pathname, host } = new URL(url);
        if (/^https?:$/.test(protocol)) name = decodeURIComponent(pathname.split("/").at(-1)) || host;
        else name = protocol === "data:" ? "data:..." : url.split(/[?#]/)[0];
    } catch {
        name = url.split(/[?#]/)[0];
    }
    return name.length <= LONGEST ? name : `${name.slice(0, LONGEST / 2)}…${name.slice(1 - LONGEST / 2)}`;
}

// Whether a page of `origin` may not load `url` because a part of the way is not encrypted.
export function isMixed(url, origin) {
    const { protocol, hostname } = new URL(url);
    return origin.startsWith("https:") && protocol === "http:" && !/^(localhost|127\..*|\[::1\]|.*\.localhost)$/.test(hostname);
}

export function isElsewhere(url, origin) {
    return /^https?:/.test(url) && new URL(url).origin !== origin;
}

// Whether a server answers, whatever it says and whomever it allows to read it.
export async function isAnswered(url) {
    try {
        await fetch(url, { mode: "no-cors", headers: { Range: "bytes=0-0" }, cache: "no-store" });
        return true;
    } catch {
        return false;
    }
}

// Pages that require trusted types allow addresses of scripts from this policy, whose name they list.
let policy = null;
export function trusted(url) {
    policy ??= globalThis.trustedTypes?.createPolicy("pbm-viewer", { createScriptURL: (address) => address }) ?? {
        createScriptURL: (address) => address,
    };
    return policy.createScriptURL(String(url));
}
