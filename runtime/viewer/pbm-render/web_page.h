// A folder for a web server: a page that shows a model with the element <pbm-viewer>, and all that the page needs.
#pragma once

#include "pbm_render/camera/camera.h"
#include "pbm_render/picture/framebuffer.h"
#include "viewer/options/view_options.h"

#include <array>
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
    const Framebuffer &poster;   // what the page shows until the model is there
    const Framebuffer &turned;   // the same for narrow screens if the first is wide, and for wide ones if it is not
    std::string language = "en"; // of the page, as in HTML; its texts are in German if it is "de", else in English
    std::string url;             // where the page will be, for previews; empty: not known
};

// A screen on which a visitor looks at a page that is as large as the screen.
struct Screen {
    const char *name;  // with "on"
    int width, height; // device pixels
};
constexpr std::array<Screen, 3> kScreens{
    {{"a phone", 1170, 2532}, {"a laptop", 1440, 900}, {"a 4K screen", 3840, 2160}}};

// Bytes that a visitor loads.
struct WebPageSizes {
    std::uint64_t page = 0, poster = 0, model = 0;
    std::uint64_t viewer = 0;          // as a server sends it with gzip
    std::uint64_t threaded_viewer = 0; // what pages that are cross-origin isolated load as well
    std::array<std::uint64_t, kScreens.size()>
        viewed{};         // of the model, on each of the screens; write_web_page leaves it
    bool is_kept = false; // index.html was edited, and left alone
};

// Factor between the distances from which a camera with this vertical view angle (radians) sees a model whole, in
// pictures of two sizes (pixels): the element keeps it when its shape changes.
double distance_factor(double view_angle, glm::ivec2 from, glm::ivec2 to);

// Writes index.html, the model, and the folder pbm-viewer with posters, styles and the viewer's files; replaces those
// of before one by one, the page last. A page that somebody edited stays. Addresses of the model and of what is made
// for it end with a hash of the contents, so that no cache shows another one.
//
// errors  those of find_web_viewer; io: a file cannot be written; the message names the file
Result<WebPageSizes> write_web_page(const WebPage &page);

} // namespace pbm
