// Whom a picture is owed to: name, credit and licence of a model, from its metadata. The metadata is untrusted text
// (BVG.md, appendix B): it becomes text nodes, and links only to http and https.

const LONGEST = 300; // characters of a text

// The metadata (JSON) as a list of texts, which may be empty.
export function creditsOf(metadata) {
    let object;
    try {
        object = JSON.parse(metadata);
    } catch {
        return [];
    }
    return [object?.name, object?.credit, object?.licence]
        .filter((text) => typeof text === "string")
        .map(plain)
        .filter((text) => text !== "");
}

// Without control characters and marks that change the direction of text.
function plain(text) {
    return text
        .replace(/[\p{C}\p{Zl}\p{Zp}]+/gu, " ")
        .trim()
        .slice(0, LONGEST);
}

// The server that an address leads to, and nothing that only looks like one; null: it is no address.
function hostOf(href) {
    try {
        return new URL(href).host;
    } catch {
        return null;
    }
}

// Parts of a text: {text} or {text, href}. A link in angle brackets belongs to the words in front of it.
export function linked(text) {
    const parts = [];
    const pattern = /<(https?:\/\/[^\s<>"]+)>|https?:\/\/[^\s<>"]*[^\s<>".,;:!?)]/g;
    let at = 0;
    for (const match of text.matchAll(pattern)) {
        const href = match[1] ?? match[0];
        const host = hostOf(href);
        if (host === null) continue;
        const before = text.slice(at, match.index).trim();
        at = match.index + match[0].length;
        if (before && match[1]) parts.push({ text: before, href });
        else parts.push(...(before ? [{ text: before }] : []), { text: host, href });
    }
    const rest = text.slice(at).trim();
    if (rest) parts.push({ text: rest });
    return parts;
}

// Fills `box` with the credits.
export function showCredits(box, metadata) {
    box.replaceChildren(
        ...creditsOf(metadata).map((text) => {
            const line = document.createElement("bdi");
            for (const part of linked(text)) {
                const node = document.createElement(part.href ? "a" : "span");
                node.textContent = part.text;
                if (part.href) Object.assign(node, { href: part.href, target: "_blank", rel: "noopener noreferrer" });
                line.append(node, " ");
            }
            return line;
        }),
    );
}
