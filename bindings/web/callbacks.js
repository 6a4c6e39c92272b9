// What JavaScript does for WebAssembly: pbm.js hands these functions to each module.
mergeInto(LibraryManager.library, {
    pbm_web_read__sig: "iijji",
    pbm_web_read: function (context, offset, size, to) {
        return Module["pbmRead"](context, offset, size, to);
    },
    pbm_web_report__sig: "iii",
    pbm_web_report: function (context, finding) {
        return Module["pbmReport"](context, finding);
    },
});
