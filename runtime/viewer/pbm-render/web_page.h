// A folder for a web server: a page that shows a model with the element <pbm-viewer>, and all that the page needs.
#pragma once

#include "pbm_render/camera/camera.h"
#include "pbm_render/picture/framebuffer.h"
#include "viewer/options/view_options.h"

#include <cstdint>
#include <string>
#include <string_view>

namespace pbm {

struct WebPage {
    std::string folder;        // is made if it is not there
    std::string model;         // file that is copied, unless it lies in the folder already
    std::string name;          // of the model in the folder, "scan.pbvg"
    std::string_view metadata; // of the model: its name becomes the title
    const ViewOptions &view;   // camera and background
    const Camera &camera;      // of the poster
    const Extent &extent;      // of the model
    UpAxis up;
    const Framebuffer &poster; // what the page shows until the model is there
};

// Bytes that a visitor loads.
struct WebPageSizes {
    std::uint64_t page = 0, poster = 0, model = 0;
    std::uint64_t viewer = 0;          // as a server sends it with gzip
    std::uint64_t threaded_viewer = 0; // what pages that are cross-origin isolated load as well
};

// Writes index.html, the model, and the folder pbm-viewer with the poster and the viewer's files; replaces those of
// before one by one, the page last.
//
// errors  those of find_web_viewer; io: a file cannot be written; the message names the file
Result<WebPageSizes> write_web_page(const WebPage &page);

} // namespace pbm
