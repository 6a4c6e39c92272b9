#include "viewer/pbm-view/window/overlay.h"

#include <imgui.h>

#include <backends/imgui_impl_opengl3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <utility>

namespace pbm {
namespace {

constexpr float kFontSize = 16;        // pixels at scale 1
constexpr float kSmallestText = 0.45F; // of the usual size

struct CardColours {
    ImU32 card, border, text, key, problem;
};
constexpr ImU32 kLine = IM_COL32(255, 205, 60, 255), kLineBorder = IM_COL32(0, 0, 0, 200); // on light and dark
constexpr CardColours kDark{IM_COL32(18, 20, 24, 240), IM_COL32(255, 255, 255, 40), IM_COL32(235, 235, 235, 255),
                            IM_COL32(255, 205, 120, 255), IM_COL32(255, 140, 120, 255)};
constexpr CardColours kLight{IM_COL32(248, 248, 246, 244), IM_COL32(0, 0, 0, 60), IM_COL32(24, 24, 28, 255),
                             IM_COL32(130, 70, 0, 255), IM_COL32(170, 20, 0, 255)};

ImU32 faded(ImU32 colour, float opacity) {
    const auto alpha = static_cast<float>(colour >> IM_COL32_A_SHIFT & 255) * opacity;
    return (colour & ~IM_COL32_A_MASK) | static_cast<ImU32>(alpha) << IM_COL32_A_SHIFT;
}

// Loads a common desktop font, or else Dear ImGui's own.
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

// Lays out text from the font's metrics. Windows of Dear ImGui need a second frame to learn their size, but a frame is
// drawn here only when something changes.
class Page {
  public:
    Page(ImDrawList &list, glm::ivec2 size, float scale, const CardColours &colours)
        : list_(list), size_(static_cast<float>(size.x), static_cast<float>(size.y)), scale_(scale), colours_(colours) {
    }

    // Draws text on a card, wrapped to the window's width. `place`: position as fractions of the free space.
    // `progress`: 0..1, as a bar under the text.
    void text(const std::string &text, ImU32 colour, ImVec2 place, std::optional<double> progress = {},
              float opacity = 1) {
        const float width = most().x, font_size = ImGui::GetFontSize();
        ImVec2 extent = ImGui::GetFont()->CalcTextSizeA(font_size, width, width, text.c_str());
        if (progress) // a card that does not change its size with the name of the step
            extent = {std::min(width, std::max(extent.x, 30 * font_size)), extent.y + font_size};
        const ImVec2 corner = card(extent, place, opacity);
        list_.AddText(nullptr, font_size, corner, faded(colour, opacity), text.c_str(), nullptr, width);
        if (!progress)
            return;
        const ImVec2 bar(corner.x, corner.y + extent.y - 0.4F * font_size),
            end(corner.x + extent.x, corner.y + extent.y);
        list_.AddRectFilled(bar, end, colours_.border, 3 * scale_);
        const float done = static_cast<float>(std::clamp(*progress, 0.0, 1.0)) * extent.x;
        list_.AddRectFilled(bar, {corner.x + done, end.y}, colours_.key, 3 * scale_);
    }

    void table(const std::string &title, const std::vector<OverlayRow> &rows) {
        const float font_size = ImGui::GetFontSize();
        const float gap = 20 * scale_, line_height = 1.3F * font_size;
        float keys = 0, meanings = measure(title).x;
        for (const OverlayRow &row : rows) {
            keys = std::max(keys, measure(row.key).x);
            meanings = std::max(meanings, measure(row.meaning).x);
        }
        const ImVec2 extent(keys + gap + meanings, line_height * (static_cast<float>(rows.size()) + 1.5F));
        // Shrink the text in a small window, down to a readable size.
        const float fit = std::clamp(std::min(most().x / extent.x, most().y / extent.y), kSmallestText, 1.0F);
        const ImVec2 corner = card({fit * extent.x, fit * extent.y}, {0.5F, 0.5F});
        const auto add = [&](float x, float y, ImU32 colour, const std::string &text) {
            list_.AddText(nullptr, fit * font_size, {corner.x + std::round(fit * x), corner.y + std::round(fit * y)},
                          colour, text.c_str());
        };
        add(0, 0, colours_.text, title);
        float y = 1.5F * line_height;
        for (const OverlayRow &row : rows) {
            add(0, y, colours_.key, row.key);
            add(keys + gap, y, colours_.text, row.meaning);
            y += line_height;
        }
    }

    void draw(const OverlayDrawing &drawing) {
        for (const OverlayDrawing::Line &line : drawing.lines)
            stroke(pixel(line.from), pixel(line.to));
        for (const glm::dvec2 &mark : drawing.marks) {
            list_.AddCircleFilled(pixel(mark), 4.5F * scale_, kLineBorder);
            list_.AddCircleFilled(pixel(mark), 3 * scale_, kLine);
        }
        for (const OverlayDrawing::Label &label : drawing.labels)
            draw_label(label);
        if (drawing.bar.pixels > 0 || !drawing.reading.empty())
            draw_lower_left(drawing.bar, drawing.reading);
    }

  private:
    static ImVec2 pixel(glm::dvec2 place) { return {static_cast<float>(place.x), static_cast<float>(place.y)}; }

    void stroke(ImVec2 from, ImVec2 to) {
        list_.AddLine(from, to, kLineBorder, 4 * scale_);
        list_.AddLine(from, to, kLine, 2 * scale_);
    }

    // Beside its place, moved into the window.
    void draw_label(const OverlayDrawing::Label &label) {
        const ImVec2 extent = measure(label.text), border(6 * scale_, 3 * scale_);
        const auto inside = [](float at, float size, float window) {
            return std::round(std::clamp(at, 0.0F, std::max(0.0F, window - size)));
        };
        const ImVec2 size(extent.x + 2 * border.x, extent.y + 2 * border.y), at = pixel(label.place);
        const ImVec2 corner(inside(at.x + 10 * scale_, size.x, size_.x), inside(at.y - size.y / 2, size.y, size_.y));
        list_.AddRectFilled(corner, {corner.x + size.x, corner.y + size.y}, colours_.card, 4 * scale_);
        list_.AddText({corner.x + border.x, corner.y + border.y}, colours_.text, label.text.c_str());
    }

    // The scale bar and, below it, a line of text.
    void draw_lower_left(const OverlayDrawing::Bar &bar, const std::string &reading) {
        const bool has_bar = bar.pixels > 0;
        const auto length = static_cast<float>(bar.pixels);
        const float line = 1.3F * ImGui::GetFontSize(), tick = 4 * scale_;
        const float rows = (has_bar ? 1.6F : 0.0F) + (reading.empty() ? 0.0F : 1.0F);
        const ImVec2 extent(std::max({length, measure(bar.text).x, measure(reading).x}), rows * line);
        const ImVec2 corner = card(extent, {0, 1});
        if (has_bar) {
            const float y = corner.y + 1.3F * line;
            list_.AddText(corner, colours_.text, bar.text.c_str());
            stroke({corner.x, y}, {corner.x + length, y});
            for (const float x : {corner.x, corner.x + length})
                list_.AddLine({x, y - tick}, {x, y + tick}, kLine, 2 * scale_);
        }
        if (!reading.empty())
            list_.AddText({corner.x, corner.y + (rows - 1) * line}, colours_.text, reading.c_str());
    }

    static ImVec2 measure(const std::string &text) { return ImGui::CalcTextSize(text.c_str()); }

    ImVec2 padding() const { return {14 * scale_, 10 * scale_}; }
    float margin() const { return 12 * scale_; }
    // Largest area that a card can hold.
    ImVec2 most() const {
        return {std::max(1.0F, size_.x - 2 * (margin() + padding().x)),
                std::max(1.0F, size_.y - 2 * (margin() + padding().y))};
    }

    // Draws the card around an area of `extent` and returns the area's upper left corner.
    ImVec2 card(ImVec2 extent, ImVec2 place, float opacity = 1) {
        // In a small window the card starts at the margin, so that its beginning is readable.
        const ImVec2 space(std::max(0.0F, most().x - extent.x), std::max(0.0F, most().y - extent.y));
        const ImVec2 corner(std::round(margin() + place.x * space.x), std::round(margin() + place.y * space.y));
        const ImVec2 end(corner.x + std::ceil(extent.x) + 2 * padding().x,
                         corner.y + std::ceil(extent.y) + 2 * padding().y);
        list_.AddRectFilled(corner, end, faded(colours_.card, opacity), 6 * scale_);
        list_.AddRect(corner, end, faded(colours_.border, opacity), 6 * scale_);
        return {corner.x + padding().x, corner.y + padding().y};
    }

    ImDrawList &list_;
    ImVec2 size_;
    float scale_;
    const CardColours &colours_;
};

} // namespace

Overlay::Overlay(double scale) : scale_(static_cast<float>(scale)) {
    ImGui::CreateContext();
    ImGuiIO &io = ImGui::GetIO();
    io.IniFilename = nullptr; // no settings file
    io.ConfigWindowsMoveFromTitleBarOnly = true;
    constexpr std::array kKeys{ImGuiKey_Backspace, ImGuiKey_Delete,     ImGuiKey_Enter, ImGuiKey_Escape, // as EditKey
                               ImGuiKey_LeftArrow, ImGuiKey_RightArrow, ImGuiKey_Home,  ImGuiKey_End,
                               ImGuiKey_UpArrow,   ImGuiKey_DownArrow,  ImGuiKey_Tab,   ImGuiKey_Space};
    for (std::size_t key = 0; key < kKeys.size(); ++key)
        io.KeyMap[kKeys[key]] = static_cast<int>(key);
    io.ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
    set_style();
    add_font(scale_);
    ImGui_ImplOpenGL3_Init("#version 150");
}

Overlay::~Overlay() {
    ImGui_ImplOpenGL3_Shutdown();
    ImGui::DestroyContext();
}

void Overlay::set_style() {
    ImGui::GetStyle() = ImGuiStyle();
    if (light_)
        ImGui::StyleColorsLight();
    else
        ImGui::StyleColorsDark();
    ImGui::GetStyle().ScaleAllSizes(scale_);
}

bool Overlay::set_light_theme(bool light) {
    const bool changes = std::exchange(light_, light) != light;
    if (changes)
        set_style();
    return changes;
}

void Overlay::set_scale(double scale) {
    if (std::exchange(scale_, static_cast<float>(scale)) == scale_)
        return;
    set_style();
    ImGui::GetIO().Fonts->Clear();
    add_font(scale_);
    ImGui_ImplOpenGL3_DestroyFontsTexture(); // the next frame makes the new one
    ImGui_ImplOpenGL3_CreateFontsTexture();
}

void Overlay::begin_frame(glm::ivec2 size) {
    ImGuiIO &io = ImGui::GetIO();
    const double now = Window::now();
    io.DisplaySize = {static_cast<float>(size.x), static_cast<float>(size.y)};
    io.DeltaTime = static_cast<float>(std::max(1e-4, now - last_frame_)); // for double clicks; Dear ImGui forbids 0
    last_frame_ = now;
    ImGui_ImplOpenGL3_NewFrame();
    ImGui::NewFrame();
}

void Overlay::draw(glm::ivec2 size, glm::ivec2 picture, const OverlayText &text, const Build &panel) {
    begin_frame(size);
    if (panel)
        panel();
    const CardColours &colours = light_ ? kLight : kDark;
    Page page(*ImGui::GetForegroundDrawList(), picture, scale_, colours);
    page.draw(text.drawing);
    if (!text.corner.empty())
        page.text(text.corner, colours.text, {0, 0});
    if (!text.status.empty())
        page.text(text.status, colours.text, {0.5F, 0}, std::nullopt, static_cast<float>(text.status_opacity));
    // Both stand in the middle: while help is shown, the message replaces its title.
    if (!text.help.empty())
        page.table(text.middle.empty() ? text.help_title : text.middle, text.help);
    else if (!text.middle.empty())
        page.text(text.middle, colours.text, {0.5F, 0.5F}, text.progress);
    if (!text.notice.empty())
        page.text(text.notice, text.notice_is_problem ? colours.problem : colours.text, {0.5F, 1});
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

void Overlay::point(glm::dvec2 pixels) {
    ImGui::GetIO().MousePos = {static_cast<float>(pixels.x), static_cast<float>(pixels.y)};
}

void Overlay::handle(const ButtonEvent &event) {
    ImGuiIO &io = ImGui::GetIO();
    io.MouseDown[event.button == MouseButton::left ? 0 : event.button == MouseButton::right ? 1 : 2] = event.pressed;
    // Control + click turns a slider into a text field; a Control key that stays down would block its characters.
    io.KeyCtrl = event.pressed && event.control;
    io.KeyShift = event.pressed && event.shift;
}

void Overlay::handle(const WheelEvent &event) { ImGui::GetIO().MouseWheel += static_cast<float>(event.notches); }

void Overlay::handle(const EditEvent &event) { ImGui::GetIO().KeysDown[static_cast<int>(event.key)] = event.pressed; }

void Overlay::handle(const CharacterEvent &event) { ImGui::GetIO().AddInputCharacter(event.character); }

void Overlay::update(glm::ivec2 size, const Build &panel) {
    // The second frame lays out what the first one changed, such as the size of a window.
    for (int frame = 0; frame < 2; ++frame) {
        begin_frame(size);
        panel();
        ImGui::EndFrame();
    }
}

bool Overlay::wants_mouse() const { return ImGui::GetIO().WantCaptureMouse; }

bool Overlay::wants_keys() const { return ImGui::GetIO().WantTextInput; }

bool Overlay::has_popup() const {
    return ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopupId | ImGuiPopupFlags_AnyPopupLevel);
}

void Overlay::release_keys() { ImGui::SetWindowFocus(nullptr); }

} // namespace pbm
