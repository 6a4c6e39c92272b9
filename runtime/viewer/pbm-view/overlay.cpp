#include "overlay.h"

#include <imgui.h>

#include <backends/imgui_impl_opengl3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

namespace pbm {
namespace {

constexpr float kFontSize = 16; // pixels at scale 1
constexpr ImU32 kCard = IM_COL32(18, 20, 24, 224);
constexpr ImU32 kBorder = IM_COL32(255, 255, 255, 40);
constexpr ImU32 kText = IM_COL32(235, 235, 235, 255);
constexpr ImU32 kKey = IM_COL32(255, 205, 120, 255);
constexpr ImU32 kProblem = IM_COL32(255, 140, 120, 255);

// A font that desktops have; without it, the one built into Dear ImGui.
void add_font(float scale) {
    constexpr std::array<const char *, 2> kFonts{"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
                                                 "/usr/share/fonts/truetype/liberation/LiberationSans-Regular.ttf"};
    ImFontAtlas &fonts = *ImGui::GetIO().Fonts;
    std::error_code ignored;
    for (const char *const path : kFonts)
        if (std::filesystem::is_regular_file(path, ignored) &&
            fonts.AddFontFromFileTTF(path, std::round(kFontSize * scale)) != nullptr)
            return;
    ImFontConfig config;
    config.SizePixels = 13 * std::round(scale); // a bitmap font: whole multiples stay sharp
    fonts.AddFontDefault(&config);
}

// Lays out text with nothing but the font: windows of Dear ImGui need a second frame to learn their size, and frames
// are drawn here only when something changes.
class Page {
  public:
    Page(ImDrawList &list, glm::ivec2 size, float scale)
        : list_(list), size_(static_cast<float>(size.x), static_cast<float>(size.y)), scale_(scale) {}

    // A line on a card; the place of its middle as fractions of the free space.
    void line(const std::string &text, ImU32 colour, ImVec2 place) {
        const ImVec2 extent = measure(text);
        const ImVec2 corner = card(extent, place);
        list_.AddText(corner, colour, text.c_str());
    }

    void table(const std::string &title, const std::vector<OverlayRow> &rows) {
        const float line_height = std::round(ImGui::GetFontSize() * 1.45F);
        float keys = 0, meanings = measure(title).x;
        for (const OverlayRow &row : rows) {
            keys = std::max(keys, measure(row.key).x);
            meanings = std::max(meanings, measure(row.meaning).x);
        }
        const float gap = 20 * scale_;
        const ImVec2 extent(keys + gap + meanings, line_height * (static_cast<float>(rows.size()) + 1.5F));
        const ImVec2 corner = card(extent, {0.5F, 0.5F});
        list_.AddText(corner, kText, title.c_str());
        float y = std::round(corner.y + 1.5F * line_height);
        for (const OverlayRow &row : rows) {
            list_.AddText({corner.x, y}, kKey, row.key.c_str());
            list_.AddText({corner.x + keys + gap, y}, kText, row.meaning.c_str());
            y += line_height;
        }
    }

  private:
    static ImVec2 measure(const std::string &text) { return ImGui::CalcTextSize(text.c_str()); }

    // Draws the card around an area of `extent` and returns the area's upper left corner.
    ImVec2 card(ImVec2 extent, ImVec2 place) {
        const ImVec2 padding(14 * scale_, 10 * scale_);
        const float margin = 12 * scale_;
        const ImVec2 outer(extent.x + 2 * padding.x, extent.y + 2 * padding.y);
        // In a window that is too small the beginning stays readable.
        const ImVec2 space(std::max(0.0F, size_.x - outer.x - 2 * margin),
                           std::max(0.0F, size_.y - outer.y - 2 * margin));
        const ImVec2 corner(std::round(margin + place.x * space.x), std::round(margin + place.y * space.y));
        const ImVec2 end(corner.x + outer.x, corner.y + outer.y);
        list_.AddRectFilled(corner, end, kCard, 6 * scale_);
        list_.AddRect(corner, end, kBorder, 6 * scale_);
        return {corner.x + padding.x, corner.y + padding.y};
    }

    ImDrawList &list_;
    ImVec2 size_;
    float scale_;
};

} // namespace

Overlay::Overlay(double scale) : scale_(static_cast<float>(scale)) {
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr; // nothing is remembered
    add_font(scale_);
    ImGui_ImplOpenGL3_Init("#version 150");
}

Overlay::~Overlay() {
    ImGui_ImplOpenGL3_Shutdown();
    ImGui::DestroyContext();
}

void Overlay::draw(glm::ivec2 size, const OverlayText &text) {
    ImGui::GetIO().DisplaySize = {static_cast<float>(size.x), static_cast<float>(size.y)};
    ImGui_ImplOpenGL3_NewFrame();
    ImGui::NewFrame();
    Page page(*ImGui::GetForegroundDrawList(), size, scale_);
    if (!text.corner.empty())
        page.line(text.corner, kText, {0, 0});
    if (!text.help.empty())
        page.table(text.help_title, text.help);
    if (!text.middle.empty())
        page.line(text.middle, kText, {0.5F, 0.5F});
    if (!text.notice.empty())
        page.line(text.notice, text.notice_is_problem ? kProblem : kText, {0.5F, 1});
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

} // namespace pbm
