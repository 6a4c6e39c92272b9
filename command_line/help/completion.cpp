#include "command_line/help/completion.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace pbm::command_line {
namespace {

// What may follow an option.
struct Values {
    bool expected = false;          // a value, in the same word or the next one
    bool optional = false;          // in the same word only: "--json[=FILE]"
    bool files = false;             // names of files and folders
    std::vector<std::string> words; // known words
};

std::vector<std::string> split(std::string_view text, char separator) {
    std::vector<std::string> parts;
    for (std::size_t end = 0; end != std::string_view::npos; text.remove_prefix(end == text.npos ? 0 : end + 1)) {
        end = text.find(separator);
        parts.emplace_back(text.substr(0, end));
    }
    return parts;
}

// A word to type is in lower case or a number ("565"); "FILE", "X,Y,Z" and "N" stand for something else.
bool is_word(const std::string &text) {
    return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.';
    });
}

Values values_of(const OptionHelp &option, const ProgramHelp &help) {
    Values values;
    if (option.value == "[TOPIC]") {
        values.words = help_topics(help);
        values.words.emplace_back("all");
        values.expected = true;
        return values;
    }
    std::string value = option.value;
    values.words = option.proposals;
    values.expected = !value.empty();
    values.optional = value.starts_with("[=");
    if (values.optional)
        value = value.substr(2, value.size() - 3);
    values.files = value.find("FILE") != std::string::npos || value.find("DIR") != std::string::npos;
    for (std::string &part : split(value, '|'))
        if (is_word(part))
            values.words.push_back(std::move(part));
    return values;
}

std::string joined(const std::vector<std::string> &words, std::string_view separator) {
    std::string text;
    for (const std::string &word : words)
        text.append(text.empty() ? "" : separator).append(word);
    return text;
}

// Whether the options are typed with one dash or two as shells expect it: -o, --output. The dissertation's are not.
bool is_modern(const std::string &name) { return name.size() == 2 || name.starts_with("--"); }

std::vector<std::string> modern_names(const OptionHelp &option) {
    std::vector<std::string> names = option.names;
    std::erase_if(names, [](const std::string &name) { return !is_modern(name); });
    return names;
}

std::vector<const OptionHelp *> options_of(const ProgramHelp &help) {
    std::vector<const OptionHelp *> options;
    for (const OptionHelp &option : help.options)
        if (!option.is_positional())
            options.push_back(&option);
    return options;
}

std::string escaped(std::string_view text, std::string_view characters, std::string_view with = "\\") {
    std::string out;
    for (const char c : text) {
        if (characters.find(c) != std::string_view::npos)
            out += with;
        out += c;
    }
    return out;
}

// Between single quotes of bash and zsh.
std::string in_quotes(std::string_view text) {
    std::string out = "'";
    for (const char c : text)
        out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return out + "'";
}

// The first clause: a list of options has one line for each.
std::string short_text(const OptionHelp &option) { return option.text.substr(0, option.text.find(';')); }

std::string function_name(const ProgramHelp &help) {
    std::string name = "_" + help.program;
    std::replace(name.begin(), name.end(), '-', '_');
    return name;
}

// bash splits --quality=fi into three words. No function of bash-completion is called: the script may be sourced.
std::string bash(const ProgramHelp &help) {
    std::vector<std::string> names;
    std::string cases;
    for (const OptionHelp *option : options_of(help)) {
        std::vector<std::string> patterns = modern_names(*option);
        names.insert(names.end(), patterns.begin(), patterns.end());
        const Values values = values_of(*option, help);
        if (!values.expected)
            continue;
        if (values.optional)
            for (std::string &pattern : patterns)
                pattern += "=";
        else
            for (std::size_t i = patterns.size(); i-- > 0;)
                if (patterns[i].starts_with("--"))
                    patterns.push_back(patterns[i] + "=");
        cases += "    " + joined(patterns, " | ") + ")\n";
        if (!values.words.empty())
            cases += "        mapfile -t COMPREPLY < <(compgen -W '" + joined(values.words, " ") + "' -- \"$word\")\n";
        if (values.files)
            cases += std::string("        compopt -o filenames\n        mapfile -t ") +
                     (values.words.empty() ? "" : "-O ${#COMPREPLY[@]} ") + "COMPREPLY < <(compgen -f -- \"$word\")\n";
        cases += "        return\n        ;;\n";
    }
    return "# Completion of " + help.program + " for bash.\n" + function_name(help) +
           "() {\n"
           "    local word=$2 before=$3\n"
           "    COMPREPLY=()\n"
           "    if [[ $word == = ]]; then\n"
           "        word= before+==\n"
           "    elif [[ $before == = ]]; then\n"
           "        before=${COMP_WORDS[COMP_CWORD - 2]}=\n"
           "    fi\n"
           "    case $before in\n" +
           cases +
           "    esac\n"
           "    if [[ $word == -* ]]; then\n"
           "        mapfile -t COMPREPLY < <(compgen -W '" +
           joined(names, " ") +
           "' -- \"$word\")\n"
           "    else\n"
           "        compopt -o filenames\n"
           "        mapfile -t COMPREPLY < <(compgen -f -- \"$word\")\n"
           "    fi\n"
           "}\n"
           "complete -F " +
           function_name(help) + " " + help.program + "\n";
}

std::string zsh(const ProgramHelp &help) {
    std::string script = "#compdef " + help.program + "\n_arguments -s -S";
    for (const OptionHelp *option : options_of(help)) {
        const Values values = values_of(*option, help);
        std::string action;
        if (values.expected) {
            action = std::string(values.optional ? "::" : ":") + escaped(option->value, ":\\") + ":";
            if (values.files && !values.words.empty())
                action += "{_files; compadd -- " + joined(values.words, " ") + "}";
            else if (values.files)
                action += "_files";
            else if (!values.words.empty())
                action += "(" + joined(values.words, " ") + ")";
        }
        const std::string text = "[" + escaped(short_text(*option), "[]\\") + "]";
        for (const std::string &name : modern_names(*option)) {
            const std::string sign = !values.expected ? "" : values.optional ? "=-" : name.size() == 2 ? "+" : "=";
            script += " \\\n    ";
            script += in_quotes(std::string("*").append(name).append(sign).append(text).append(action));
        }
    }
    return script + " \\\n    '*:FILE:_files'\n";
}

std::string fish(const ProgramHelp &help) {
    std::string script = "# Completion of " + help.program + " for fish.\n";
    for (const OptionHelp *option : options_of(help)) {
        const Values values = values_of(*option, help);
        script += "complete -c " + help.program;
        for (const std::string &name : modern_names(*option))
            script += name.size() == 2 ? " -s " + name.substr(1) : " -l " + name.substr(2);
        if (values.expected && !values.optional)
            script += values.files ? " -r -F" : " -x";
        if (!values.words.empty())
            script += " -a '" + joined(values.words, " ") + "'";
        script += " -d '" + escaped(short_text(*option), "\\'") + "'\n";
    }
    return script;
}

} // namespace

std::optional<std::string> completion_script(const ProgramHelp &help, std::string_view shell) {
    if (shell == "bash")
        return bash(help);
    if (shell == "zsh")
        return zsh(help);
    if (shell == "fish")
        return fish(help);
    return std::nullopt;
}

} // namespace pbm::command_line
