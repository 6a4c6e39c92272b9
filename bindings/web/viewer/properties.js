// Properties that mirror attributes: frameworks set those rather than attributes. The attribute of `autoRotate` is
// `auto-rotate`.

// By name: what its values are. Texts and numbers are null where the element lacks the attribute; null and undefined
// remove it.
export const PROPERTIES = {
    src: String,
    alt: String,
    poster: String,
    quality: String,
    backs: String,
    cameraOrbit: String,
    cameraTarget: String,
    fieldOfView: String,
    background: String,
    exposure: Number,
    shading: String,
    lightFollows: String,
    headlight: String,
    colourBy: String,
    dropClass: String,
    showClass: String,
    loading: String,
    reveal: String,
    touchAction: String,
    interactionPrompt: String,
    maxMemory: Number,
    autoRotate: Boolean,
    controls: Boolean,
    disableZoom: Boolean,
    noLegend: Boolean,
};

// Whether a Boolean attribute is set. Frameworks write ="false" for one that is not.
export function isOn(element, attribute) {
    return element.hasAttribute(attribute) && element.getAttribute(attribute) !== "false";
}

// The words of attributes that have no other values; the first one is the default.
export const WORDS = {
    quality: ["auto", "fast", "fine"],
    backs: ["auto", "show", "hide"],
    shading: ["auto", "lit", "unlit"],
    "light-follows": ["default", "eye", "model"],
    loading: ["auto", "lazy", "eager"],
    reveal: ["auto", "manual"],
    "touch-action": ["pan-y", "none"],
    "interaction-prompt": ["none", "auto"],
};

// The word that an attribute of an element has; its default, and a warning, where it says anything else.
export function wordOf(element, attribute) {
    const text = element.getAttribute(attribute);
    const words = WORDS[attribute];
    if (text === null || words.includes(text)) return text ?? words[0];
    warnOnce(element, attribute, text, `is none of ${words.join(", ")}`);
    return words[0];
}

const warned = new WeakMap(); // element -> what it was warned of
export function warnOnce(element, attribute, text, fault) {
    const warning = `pbm-viewer: ${attribute}="${text}" ${fault}`;
    if (!warned.has(element)) warned.set(element, new Set());
    if (warned.get(element).has(warning)) return;
    warned.get(element).add(warning);
    console.warn(warning);
}

// Gives a class of elements the properties.
export function defineProperties(prototype) {
    for (const [name, type] of Object.entries(PROPERTIES)) {
        const attribute = name.replace(/[A-Z]/g, (letter) => `-${letter.toLowerCase()}`);
        Object.defineProperty(prototype, name, {
            configurable: true,
            enumerable: true,
            get() {
                if (type === Boolean) return isOn(this, attribute);
                const text = this.getAttribute(attribute);
                return text === null ? null : type(text);
            },
            set(value) {
                if (type === Boolean) this.toggleAttribute(attribute, Boolean(value));
                else if (value === null || value === undefined) this.removeAttribute(attribute);
                else this.setAttribute(attribute, value);
            },
        });
    }
}

// A page may have set properties before the code of its element was there: they would hide those of the class.
export function adoptProperties(element) {
    for (const name of Object.keys(PROPERTIES)) {
        if (!Object.hasOwn(element, name)) continue;
        const value = element[name];
        delete element[name];
        element[name] = value;
    }
}
