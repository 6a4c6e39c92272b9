// What the element says, in the languages that it speaks. A text has places, {name}, for values.

export const TEXTS = {
    en: {
        label: "3D scan",
        role: "3D model",
        keys: "{label}. Arrow keys turn the view, plus and minus zoom.",
        close: "Close",
        fullscreen: "Full screen",
        about: "Name and credit",
        back: "Back to the first model",
        prompt: "Drag to turn",
        promptFinger: "Drag with one finger to turn",
        view: "View from the {place}",
        places: {
            top: "top",
            bottom: "bottom",
            upper: "upper {side}",
            lower: "lower {side}",
            sides: ["front", "front right", "right", "back right", "back", "back left", "left", "front left"],
        },
        partly: "Not all of this model can be shown: {reason}",
        damaged: "{reason}",
        byte: "{reason} (byte {offset})",
        noAddress: '"{name}" is no address of a model.',
        unreadable: "{name} cannot be read ({reason}).",
        mixed: "{name} is not loaded: a page of https: may not load from http:.",
        foreign: "{name} is not loaded: its server allows other sites nothing (Access-Control-Allow-Origin).",
        forbidden: "{name} is not loaded: the Content-Security-Policy forbids it ({directive}).",
        status: "The server answered {status} for {name}.",
        silent: "The server does not answer for {name}. The viewer waits for it.",
        again: "{name} cannot be read ({reason}). The viewer tries again.",
        changed: "The file changed on the server: load the page again.",
        tooLarge: "The server answers no ranges, and the whole file needs more memory than max-memory allows: finer detail is left out.",
        ranges: "The server breaks the rules of range requests for {name}: {reason}.",
        fileGone: "The file can no longer be read: open it again.",
        worker: "The worker of the viewer cannot run: are all files of the package on the server?",
        code: "The code of the viewer cannot be loaded ({reason}).",
        noWebAssembly: "The Content-Security-Policy forbids WebAssembly: script-src lacks 'wasm-unsafe-eval'.",
        cut: "The file is cut short: {have} of {size} bytes are there.",
        memory: "This view needs more than the {megabytes} MB that max-memory allows.",
    },
    de: {
        label: "3D-Scan",
        role: "3D-Modell",
        keys: "{label}. Pfeiltasten drehen die Ansicht, Plus und Minus zoomen.",
        close: "Schließen",
        fullscreen: "Vollbild",
        about: "Name und Urheber",
        back: "Zurück zum ersten Modell",
        prompt: "Zum Drehen ziehen",
        promptFinger: "Zum Drehen mit einem Finger ziehen",
        view: "Ansicht von {place}",
        places: {
            top: "oben",
            bottom: "unten",
            upper: "{side} oben",
            lower: "{side} unten",
            sides: ["vorn", "vorn rechts", "rechts", "hinten rechts", "hinten", "hinten links", "links", "vorn links"],
        },
        partly: "Nicht alles von diesem Modell kann gezeigt werden: {reason}",
        damaged: "Die Datei ist beschädigt ({name}).",
        byte: "{reason} (Byte {offset})",
        noAddress: "„{name}“ ist keine Adresse eines Modells.",
        unreadable: "{name} kann nicht gelesen werden ({reason}).",
        mixed: "{name} wird nicht geladen: Eine Seite mit https: darf nichts von http: laden.",
        foreign: "{name} wird nicht geladen: Der Server erlaubt anderen Seiten nichts (Access-Control-Allow-Origin).",
        forbidden: "{name} wird nicht geladen: Die Content-Security-Policy verbietet es ({directive}).",
        status: "Der Server antwortete {status} für {name}.",
        silent: "Der Server antwortet nicht für {name}. Die Anzeige wartet.",
        again: "{name} kann nicht gelesen werden ({reason}). Die Anzeige versucht es wieder.",
        changed: "Die Datei auf dem Server hat sich geändert: Laden Sie die Seite neu.",
        tooLarge: "Der Server sendet nur ganze Dateien, und diese braucht mehr Speicher, als max-memory erlaubt: Feinheiten fehlen.",
        ranges: "Der Server bricht die Regeln für Teilanfragen bei {name}: {reason}.",
        fileGone: "Die Datei kann nicht mehr gelesen werden: Öffnen Sie sie noch einmal.",
        worker: "Der Worker der Anzeige kann nicht laufen: Sind alle Dateien des Pakets auf dem Server?",
        code: "Der Code der Anzeige kann nicht geladen werden ({reason}).",
        noWebAssembly: "Die Content-Security-Policy verbietet WebAssembly: In script-src fehlt 'wasm-unsafe-eval'.",
        cut: "Die Datei ist abgeschnitten: {have} von {size} Bytes sind da.",
        memory: "Diese Ansicht braucht mehr als die {megabytes} MB, die max-memory erlaubt.",
    },
};

// The text of this key, in the language that comes first of those spoken.
export function textOf(language, key, values = {}) {
    return filled((TEXTS[language] ?? TEXTS.en)[key], values);
}

export function filled(text, values) {
    return text.replace(/\{(\w+)\}/g, (place, name) => values[name] ?? place);
}

// The language of an element's content (its own attribute `lang`, or that of what it is in), as a key of TEXTS.
export function languageOf(element) {
    for (let at = element; at; at = at.parentNode ?? at.host) {
        const language = at.getAttribute?.("lang")?.toLowerCase().split("-")[0];
        if (language) return language in TEXTS ? language : "en";
    }
    return "en";
}

// What a notice says of an error ({message, name, offset, key, values}): errors of the viewer have a key; those of the
// file are told in the words of the validator.
export function noticeOf(language, { message, name, offset, key, values }, isFatal) {
    let reason = key ? textOf(language, key, values) : textOf(language, "damaged", { reason: message, name });
    if (isFatal) return reason;
    if (offset !== null) reason = textOf(language, "byte", { reason, offset });
    return textOf(language, "partly", { reason });
}
