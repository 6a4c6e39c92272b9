#include "viewer/pbm-view/window/start_page.h"

#include <imgui.h>

#include <algorithm>
#include <filesystem>
#include <utility>

namespace pbm {
namespace {

constexpr float kCardWidth = 560, kCardMargin = 12; // pixels at scale 1
const ImVec4 kProblemColour{1, 0.6F, 0.5F, 1}, kKeyColour{1, 0.8F, 0.47F, 1}, kFaintColour{0.72F, 0.72F, 0.74F, 1};

// The end of a text that is too wide, after dots.
std::string shortened(std::string text, float width) {
    std::size_t at = 0;
    while (at < text.size() && ImGui::CalcTextSize(text.c_str() + at).x > width)
        do
            ++at;
        while (at < text.size() && (static_cast<unsigned char>(text[at]) & 0xC0) == 0x80); // within a character
    return at == 0 ? text : "..." + text.substr(std::min(at + 3, text.size()));
}

} // namespace

void StartPage::show(std::vector<std::string> recent) {
    recent_ = std::move(recent);
    shown_ = true;
    selected_ = has_details() ? 1 : 0; // the dialog
}

void StartPage::set_problem(std::optional<Problem> problem) {
    problem_ = std::move(problem);
    details_ = false;
    selected_ = has_details() ? 1 : 0;
}

void StartPage::move(int rows) { selected_ = (selected_ + rows + this->rows()) % this->rows(); }

std::optional<StartPage::Choice> StartPage::take() {
    int row = selected_;
    if (has_details() && row-- == 0) {
        details_ = !details_;
        return std::nullopt;
    }
    return Choice{row == 0 ? "" : recent_[static_cast<std::size_t>(row - 1)]};
}

std::optional<StartPage::Choice> StartPage::build(glm::ivec2 size, float scale, bool over_model) {
    const ImVec2 window(static_cast<float>(size.x), static_cast<float>(size.y));
    const float margin = kCardMargin * scale, width = std::min(kCardWidth * scale, window.x - 2 * margin);
    if (over_model)
        ImGui::SetNextWindowPos({window.x / 2, window.y - margin}, ImGuiCond_Always, {0.5F, 1});
    else
        ImGui::SetNextWindowPos({window.x / 2, window.y / 2}, ImGuiCond_Always, {0.5F, 0.5F});
    ImGui::SetNextWindowSizeConstraints({width, 0}, {width, std::max(1.0F, window.y - 2 * margin)});
    ImGui::SetNextWindowBgAlpha(0.94F);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 6 * scale);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {16 * scale, 14 * scale});
    ImGui::Begin("Start", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings);
    std::optional<Choice> choice;
    int row = 0;
    // A row with a text at its right end. Returns whether it was clicked.
    const auto add_row = [&](const std::string &text, const std::string &right, ImVec4 right_colour) {
        ImGui::PushID(row);
        const bool clicked = ImGui::Selectable(text.c_str(), row == selected_);
        ImGui::PopID();
        if (clicked)
            selected_ = row;
        const float free = ImGui::GetContentRegionAvail().x - ImGui::CalcTextSize(text.c_str()).x - 24 * scale;
        const std::string end = shortened(right, free);
        ImGui::SameLine();
        ImGui::SetCursorPosX(ImGui::GetWindowContentRegionMax().x - ImGui::CalcTextSize(end.c_str()).x);
        ImGui::TextColored(right_colour, "%s", end.c_str());
        ++row;
        return clicked;
    };
    if (problem_) {
        const auto &[file, explanation] = *problem_;
        if (!file.empty())
            ImGui::TextColored(kProblemColour, "%s", file.c_str());
        ImGui::TextWrapped("%s", explanation.what.c_str());
        if (!explanation.advice.empty())
            ImGui::TextWrapped("%s", explanation.advice.c_str());
        if (has_details() && add_row(details_ ? "Hide details" : "Details", "", kKeyColour))
            details_ = !details_;
        if (details_) {
            ImGui::Indent();
            for (const std::string &line : explanation.details)
                ImGui::TextWrapped("%s", line.c_str());
            ImGui::Unindent();
        }
        ImGui::Separator();
    }
    if (add_row("Open a model or a scan ...", "Ctrl + O", kKeyColour))
        choice = Choice{};
    if (!recent_.empty())
        ImGui::TextColored(kFaintColour, "Opened last");
    for (const std::string &path : recent_)
        if (add_row(std::filesystem::path(path).filename().string(), std::filesystem::path(path).parent_path().string(),
                    kFaintColour))
            choice = Choice{path};
    ImGui::Separator();
    ImGui::TextColored(kFaintColour, "Or drop files or a folder here.  F1: keys  Escape: close");
    ImGui::End();
    ImGui::PopStyleVar(2);
    return choice;
}

} // namespace pbm
