#include "command_line/help/help.h"

#include "command_line/spelling.h"

#include <algorithm>
#include <array>

namespace pbm::command_line {
namespace {

constexpr std::size_t kTextColumn = 28;

constexpr std::array<std::string_view, 6> kExitStatus{"done or valid",
                                                      "usage",
                                                      "input or output",
                                                      "invalid or damaged input",
                                                      "memory or another limit of the running program",
                                                      "unsupported version or feature"};
constexpr std::array<std::string_view, 7> kFamily{"pbm-build",  "pbm-export",   "pbm-info", "pbm-render",
                                                  "pbm-sample", "pbm-validate", "pbm-view"};

std::string topic_word(std::string_view title) {
    std::string word(title);
    for (char &c : word)
        c = c == ' ' ? '-' : c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return word;
}

std::vector<std::string> titles(const ProgramHelp &help) {
    std::vector<std::string> found;
    for (const OptionHelp &option : help.options)
        if (!option.is_positional() && std::find(found.begin(), found.end(), option.topic) == found.end())
            found.push_back(option.topic);
    std::stable_partition(found.begin(), found.end(), [](const std::string &title) { return title != "General"; });
    return found;
}

// Breaks `text` at spaces and line feeds into lines of at most `width` columns.
std::vector<std::string> wrapped(std::string_view text, std::size_t width) {
    std::vector<std::string> lines;
    while (!text.empty()) {
        std::size_t end = std::min(text.find('\n'), text.size());
        if (end > width) {
            end = text.rfind(' ', width);
            if (end == std::string_view::npos || end == 0)
                end = std::min(text.find_first_of(" \n"), text.size());
        }
        lines.emplace_back(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return lines;
}

std::string paragraph(std::string_view text) {
    std::string page;
    for (const std::string &line : wrapped(text, kPageColumns - 1))
        page += line + "\n";
    return page;
}

// "  -o, --output FILE         What it does": the text stands in its column, on as many lines as needed.
std::string entry(std::string left, std::string_view text) {
    left = "  " + left;
    const std::string indent(kTextColumn, ' ');
    std::string lines = left;
    for (const std::string &line : wrapped(text, kPageColumns - 1 - kTextColumn)) {
        const bool is_beside = lines.size() + 2 <= kTextColumn; // only the first line
        lines.append(is_beside ? indent.substr(left.size()) : "\n" + indent).append(line);
    }
    return lines + "\n";
}

std::string entry(const OptionHelp &option) {
    std::string left = option.names.front().starts_with("--") ? "    " : "";
    for (const std::string &name : option.names)
        left += (&name == &option.names.front() ? "" : ", ") + name;
    if (option.is_positional() && option.several)
        left += "...";
    if (option.value.starts_with("[="))
        left += option.value;
    else if (!option.value.empty())
        left += " " + option.value;
    return entry(std::move(left), option.text);
}

// "[OPTIONS] FILE..."
std::string arguments_of(const ProgramHelp &help) {
    std::string line = "[OPTIONS]";
    for (const OptionHelp &option : help.options)
        if (option.is_positional()) {
            const std::string name = option.names.front() + (option.several ? "..." : "");
            line += option.required ? " " + name : " [" + name + "]";
        }
    return line;
}

// The entries of a topic, each made by `text`; those of the positional arguments if `title` is empty.
std::string entries_of(const ProgramHelp &help, std::string_view title, std::string (*text)(const OptionHelp &)) {
    std::string entries;
    for (const OptionHelp &option : help.options)
        if (option.topic == title)
            entries += text(option);
    return entries;
}

std::string topic_entries(const ProgramHelp &help, const std::string &title) {
    return title + ":\n" + entries_of(help, title, entry);
}

std::size_t line_count(const std::string &page) {
    return static_cast<std::size_t>(std::count(page.begin(), page.end(), '\n'));
}

std::string exit_line(const ProgramHelp &help) {
    return paragraph("Exit codes: 0 done, 1 usage, 2 I/O, 3 damaged input, 4 memory" +
                     (help.manual.run_time_limits.empty() ? "" : " or " + help.manual.run_time_limits) +
                     ", 5 unsupported.");
}

std::string beginning(const ProgramHelp &help) {
    return paragraph(help.summary) + "Usage: " + help.program + " " + arguments_of(help) + "\n" +
           entries_of(help, "", entry);
}

std::string everything(const ProgramHelp &help) {
    std::string page = beginning(help);
    for (const std::string &title : titles(help))
        page += topic_entries(help, title);
    return page + exit_line(help) + paragraph(help.description);
}

bool is_most_used(const ProgramHelp &help, const OptionHelp &option) {
    const std::vector<std::string> &names = option.names, &most_used = help.manual.most_used;
    if (most_used.empty())
        return std::any_of(names.begin(), names.end(), [](const std::string &name) { return name.size() == 2; });
    return std::find_first_of(names.begin(), names.end(), most_used.begin(), most_used.end()) != names.end();
}

// "  grid                      --depth --voxel-size", truncated at the end of the line.
std::string topic_line(const ProgramHelp &help, const std::string &title) {
    std::string names;
    for (const OptionHelp &option : help.options) {
        if (option.topic != title)
            continue;
        const auto longer = std::find_if(option.names.begin(), option.names.end(),
                                         [](const std::string &name) { return name.starts_with("--"); });
        const std::string &name = longer == option.names.end() ? option.names.front() : *longer;
        if (kTextColumn + names.size() + 1 + name.size() > kPageColumns - 5) {
            names += " ...";
            break;
        }
        names += (names.empty() ? "" : " ") + name;
    }
    return entry(topic_word(title), names);
}

std::string first_page(const ProgramHelp &help) {
    std::string all = everything(help);
    if (line_count(all) <= kPageLines)
        return all;
    std::string page = beginning(help) + "Options used most:\n";
    for (const OptionHelp &option : help.options)
        if (!option.is_positional() && is_most_used(help, option))
            page += entry(option);
    page += "Topics; " + help.program + " --help TOPIC tells more, --help all tells everything:\n";
    for (const std::string &title : titles(help))
        page += topic_line(help, title);
    page += exit_line(help);
    const std::string further = page + paragraph(help.description);
    return line_count(further) <= kPageLines ? further : page;
}

// Escapes text for roff: no requests, no escapes, minus signs that can be copied.
std::string roff(std::string_view text) {
    std::string out;
    for (const char c : text) {
        if (c == '\\')
            out += "\\e";
        else if (c == '-')
            out += "\\-";
        else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n'))
            out += std::string("\\&") + c;
        else
            out += c;
    }
    return out;
}

// Text on separate lines.
std::string roff_lines(std::string_view text) {
    std::string lines;
    for (const std::string &line : wrapped(text, kPageColumns - 8)) // escapes lengthen the lines
        lines += roff(line) + "\n";
    return lines;
}

std::string roff_entry(const OptionHelp &option) {
    std::string text = ".TP\n";
    for (const std::string &name : option.names)
        text += (&name == &option.names.front() ? "" : ", ") + std::string(option.is_positional() ? "\\fI" : "\\fB") +
                roff(name) + "\\fR";
    if (option.value.starts_with("[="))
        text += "[=\\fI" + roff(option.value.substr(2, option.value.size() - 3)) + "\\fR]";
    else if (!option.value.empty())
        text += " \\fI" + roff(option.value) + "\\fR";
    return text + "\n" + roff_lines(option.text);
}

} // namespace

std::vector<std::string> help_topics(const ProgramHelp &help) {
    std::vector<std::string> words;
    for (const std::string &title : titles(help))
        words.push_back(topic_word(title));
    return words;
}

Result<std::string> help_page(const ProgramHelp &help, std::string_view topic) {
    if (topic.empty())
        return first_page(help);
    if (topic == "all")
        return everything(help);
    if (topic == "man")
        return man_page(help);
    for (const std::string &title : titles(help))
        if (topic_word(title) == topic)
            return topic_entries(help, title);
    std::vector<std::string> topics = help_topics(help);
    topics.emplace_back("all");
    std::string message = "there is no help on '" + std::string(topic) + "'; ";
    if (const std::string nearest = nearest_word(topic, topics); !nearest.empty())
        return usage_error(message + "did you mean '" + nearest + "'?");
    message += "topics are";
    for (const std::string &word : topics)
        message += (&word == &topics.front() ? " " : ", ") + word;
    return usage_error(message);
}

std::string man_page(const ProgramHelp &help) {
    std::string name = help.program, summary = help.summary;
    for (char &c : name)
        c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    if (summary.ends_with('.'))
        summary.pop_back();
    if (summary.size() > 1 && summary[0] >= 'A' && summary[0] <= 'Z')
        summary[0] = static_cast<char>(summary[0] - 'A' + 'a');
    std::string page = ".TH " + roff(name) + " 1 \"\" \"pbm " + roff(help.version) + "\" \"Point\\-based models\"\n";
    page += ".SH NAME\n" + roff(help.program) + " \\-\n" + roff_lines(summary);
    page += ".SH SYNOPSIS\n.B " + roff(help.program) + "\n" + roff(arguments_of(help)) + "\n";
    page += ".SH DESCRIPTION\n" + roff_lines(help.summary);
    for (const std::string &text : wrapped(help.description, help.description.size() + 1))
        page += ".PP\n" + roff_lines(text);
    page += ".SH OPTIONS\n" + entries_of(help, "", roff_entry);
    for (const std::string &title : titles(help))
        page += ".SS " + roff(title) + "\n" + entries_of(help, title, roff_entry);
    page += ".SH EXIT STATUS\n";
    for (std::size_t code = 0; code < kExitStatus.size(); ++code)
        page += ".TP\n.B " + std::to_string(code) + "\n" + std::string(kExitStatus[code]) +
                (code == 4 && !help.manual.run_time_limits.empty() ? ": " + help.manual.run_time_limits : "") + "\n";
    if (!help.manual.examples.empty())
        page += ".SH EXAMPLES\n";
    for (const Example &example : help.manual.examples)
        page += ".TP\n.B " + roff(example.command) + "\n" + roff_lines(example.text);
    std::string others;
    for (const std::string_view other : kFamily)
        if (other != help.program)
            others += (others.empty() ? "" : ",\n") + std::string(".BR ") + roff(other) + " (1)";
    return page + ".SH SEE ALSO\n" + others + "\n";
}

} // namespace pbm::command_line
