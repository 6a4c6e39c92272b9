#include "command_line/parse.h"

#include "command_line/help/completion.h"
#include "command_line/json_report.h"
#include "system/files/mapped_file.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <utility>

namespace pbm::command_line {
namespace {

bool names_file(const CLI::Option &option) {
    return option.get_positional() || option.check_lname("output") ||
           option.get_type_name().find("FILE") != std::string::npos;
}

bool names_file(const CLI::Option &option, const std::string &value) {
    const std::vector<std::string> words = CLI::detail::split(option.get_type_name(), '|');
    return names_file(option) && (words.size() == 1 || std::count(words.begin() + 1, words.end(), value) == 0);
}

constexpr const char *kAllowOutside = "--allow-outside";

bool names_output(const CLI::Option &option) {
    return option.check_lname("output") || option.check_lname("json") || option.check_lname("log") ||
           option.check_lname("dependency-file");
}

// "N" for numbers, "565|888" for words; CLI11's names are INT:INT in [5 - 16] and TEXT:{565,888}.
std::string value_name(const CLI::Option &option) {
    if (option.check_lname("help"))
        return "[TOPIC]";
    if (option.get_items_expected_max() == 0)
        return {};
    const std::string type = option.get_type_name();
    const std::string base = type.substr(0, type.find(':'));
    if (const std::size_t words = type.find('{'); words != std::string::npos && type.ends_with('}')) {
        std::string joined = type.substr(words + 1, type.size() - words - 2);
        std::replace(joined.begin(), joined.end(), ',', '|');
        return joined;
    }
    if (names_file(option) && base == "TEXT")
        return "FILE";
    return base == "INT" || base == "UINT" || base == "FLOAT" ? "N" : base;
}

std::string first_result(const CLI::Option *option) {
    return option == nullptr || option->results().empty() ? "" : option->results().front();
}

// Exception of an option's handler: an error about the file `path`.
struct Refusal {
    std::string path;
    Error error;
};

// CLI11 reads the settings after the command line and before it checks for missing options.
class SettingsReader : public CLI::Config {
  public:
    SettingsReader(CLI::App &app, ReadSettings read) : app_(app), read_(std::move(read)) {}

    std::string to_config(const CLI::App *, bool, bool, std::string) const override { return {}; }

    std::vector<CLI::ConfigItem> from_config(std::istream &) const override {
        const std::string path = first_result(app_.get_config_ptr());
        const auto settings = read_(path);
        if (!settings)
            throw Refusal{path, settings.error()};
        std::vector<const CLI::Option *> given, set;
        for (const CLI::Option *option : app_.get_options())
            if (option->count() > 0)
                given.push_back(option);
        for (const Setting &setting : *settings)
            if (const std::string wrong = apply(setting, path, given, set); !wrong.empty())
                throw Refusal{path, usage_error("line " + std::to_string(line_of(setting, wrong)) + ": " + wrong)};
        return {};
    }

    // Options that settings have set.
    bool has_set(const CLI::Option *option) const { return contains(applied_, option); }

  private:
    static bool contains(const std::vector<const CLI::Option *> &options, const CLI::Option *option) {
        return std::find(options.begin(), options.end(), option) != options.end();
    }

    static std::vector<std::string> keys_of(const CLI::Option &option) {
        if (option.check_lname("help") || option.check_lname("version") || !option.get_configurable())
            return {};
        std::vector<std::string> keys = option.get_lnames();
        if (option.get_positional())
            keys.push_back(CLI::detail::to_lower(option.get_name(true)));
        return keys;
    }

    CLI::Option *find(const std::string &key) const {
        for (CLI::Option *option : app_.get_options()) {
            const auto keys = keys_of(*option);
            if (option != app_.get_config_ptr() && std::find(keys.begin(), keys.end(), key) != keys.end())
                return option;
        }
        return nullptr;
    }

    std::string unknown(const std::string &key) const {
        std::vector<std::string> known;
        for (const CLI::Option *option : app_.get_options())
            if (option != app_.get_config_ptr())
                for (const std::string &name : keys_of(*option))
                    known.push_back(name);
        const std::string nearest = nearest_word(key, known);
        return "unknown key '" + key + "'" + (nearest.empty() ? "" : "; did you mean '" + nearest + "'?");
    }

    static std::string wrong_type(const Setting &setting, const CLI::Option &option) {
        const std::string value = value_name(option), key = "'" + setting.key + "' ";
        const bool flag = option.get_items_expected_max() == 0;
        if (flag != (setting.kind == Setting::Kind::flag))
            return key + (flag ? "is true or false" : "takes a value, not true or false");
        if (flag)
            return {};
        if (value == "N" && (setting.kind != Setting::Kind::number || setting.is_array))
            return key + "takes one number";
        if ((value == "TEXT" || names_file(option)) && setting.kind != Setting::Kind::text)
            return key + "takes a string in quotes";
        if (setting.is_array && option.get_items_expected_max() == 1 && value.find(',') == std::string::npos)
            return key + "takes one value, not an array";
        return {};
    }

    // File names in a file of settings are relative to its folder.
    static std::vector<std::string> values_of(const Setting &setting, const CLI::Option &option,
                                              const std::string &path) {
        std::vector<std::string> values = setting.values;
        const std::string folder = path.substr(0, path.find_last_of('/') + 1);
        for (std::string &name : values)
            if (names_file(option, name) && !name.empty() && name != "-" && name.front() != '/')
                name.insert(0, folder);
        if (setting.is_array && option.get_items_expected_max() == 1)
            values = {CLI::detail::join(values, ",")};
        return values;
    }

    static std::size_t line_of(const Setting &setting, const std::string &wrong) {
        const auto &lines = setting.lines_of_keys;
        const auto key = std::find_if(lines.begin(), lines.end(),
                                      [&](const auto &known) { return wrong.find(known.first) != std::string::npos; });
        return key == lines.end() ? setting.line : key->second;
    }

    // Others may have written the settings: what these write stays in their folder.
    std::string outside(const std::string &key, const CLI::Option &option, const std::vector<std::string> &values,
                        const std::string &path) const {
        if (!names_output(option) || app_.get_option(kAllowOutside)->count() > 0)
            return {};
        for (const std::string &name : values)
            if (!name.empty() && name != "-" && !is_below(name, path))
                return std::string("'")
                    .append(key)
                    .append("' names ")
                    .append(name)
                    .append(", outside the folder of this file; ")
                    .append(kAllowOutside)
                    .append(" on the command line allows that");
        return {};
    }

    // Applies a setting; returns what is wrong with it, or "". The command line overrules it by the same option or by
    // one that excludes it.
    std::string apply(const Setting &setting, const std::string &path, const std::vector<const CLI::Option *> &given,
                      std::vector<const CLI::Option *> &set) const {
        CLI::Option *const option = find(setting.key);
        if (option == nullptr)
            return unknown(setting.key);
        if (contains(set, option) && option->get_items_expected_max() == 1)
            return "'" + setting.key + "' is set twice, under two names";
        set.push_back(option);
        if (setting.values.empty())
            return "'" + setting.key + "' is empty";
        if (std::string wrong = wrong_type(setting, *option); !wrong.empty())
            return wrong;
        bool overruled = contains(given, option);
        for (const CLI::Option *other : option->get_excludes())
            overruled = overruled || contains(given, other);
        if (overruled || (setting.kind == Setting::Kind::flag && setting.values.front() == "false"))
            return {};
        for (const CLI::Option *other : option->get_excludes())
            if (other->count() > 0) // by an earlier line
                return "'" + setting.key + "' excludes '" + other->get_lnames().front() + "'; keep one of them";
        const std::vector<std::string> values = values_of(setting, *option, path);
        if (std::string wrong = outside(setting.key, *option, values, path); !wrong.empty())
            return wrong;
        try {
            for (const std::string &value : values)
                option->add_result(value);
            option->run_callback();
            applied_.push_back(option);
        } catch (const CLI::ParseError &error) {
            return error.what();
        }
        return {};
    }

    CLI::App &app_;
    ReadSettings read_;
    mutable std::vector<const CLI::Option *> applied_;
};

template <class... Functions> struct Overloaded : Functions... { using Functions::operator()...; };
template <class... Functions> Overloaded(Functions...) -> Overloaded<Functions...>;

CLI::Option *add_target(CLI::App &app, const Option &option) {
    const std::string &names = option.names, &help = option.help;
    return std::visit(
        Overloaded{
            [&](bool *target) {
                CLI::Option *const flag = app.add_flag(names, *target, help);
                if (names.find('!') != std::string::npos)
                    flag->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
                return flag;
            },
            [&](std::string *target) {
                return option.rules.alone.empty() ? app.add_option(names, *target, help)
                                                  : app.add_flag(names + "{" + option.rules.alone + "}", *target, help);
            },
            [&](std::vector<std::string> *target) {
                CLI::Option *const several = app.add_option(names, *target, help)->delimiter(option.rules.separator);
                return several->get_positional() ? several : several->allow_extra_args(false);
            },
            [&](auto *target) { return app.add_option(names, *target, help); },
            [&](const std::function<void()> &call) { return app.add_flag_callback(names, call, help); },
            [&](const std::function<void(int)> &call) { return app.add_option_function<int>(names, call, help); },
            [&](const std::function<Status(const std::string &)> &store) {
                const std::function<void(const std::string &)> call = [&store](const std::string &text) {
                    if (const Status status = store(text); !status)
                        throw CLI::ValidationError(status.error().message);
                };
                return app.add_option_function(names, call, help);
            },
            [&](const Version &version) { return app.set_version_flag(names, version.text, help); },
            [&](const SettingsFile &file) {
                app.config_formatter(std::make_shared<SettingsReader>(app, file.read));
                // CLI11 would wait for the writer of a pipe.
                return app.set_config(names, "", help)->check([](const std::string &path) {
                    if (const auto opened = MappedFile::open(path); !path.empty() && !opened)
                        throw Refusal{path, opened.error()};
                    return std::string();
                });
            }},
        option.target);
}

// The option of that name, which was declared before. (App::get_option ends the process where memory runs out.)
CLI::Option *declared_option(CLI::App &app, const std::string &name) {
    for (CLI::Option *option : app.get_options())
        if (option->check_name(name))
            return option;
    throw CLI::OptionNotFound(name);
}

// `app` keeps references to `option`.
void declare(CLI::App &app, const Option &option) {
    const OptionRules &rules = option.rules;
    app.option_defaults()->group(rules.topic);
    CLI::Option *const declared = add_target(app, option)->required(rules.required)->configurable(rules.is_setting);
    if (!rules.type.empty())
        declared->type_name(rules.type);
    std::visit(Overloaded{[](std::monostate) {},
                          [&](const Integers &limits) { declared->check(CLI::Range(limits.least, limits.most)); },
                          [&](const Numbers &limits) { declared->check(CLI::Range(limits.least, limits.most)); },
                          [&](const Words &words) { declared->check(CLI::IsMember(words)); },
                          [&](const auto &check) { declared->check(check); }},
               rules.check);
    if (rules.shows_default)
        declared->capture_default_str();
    for (const std::string &other : rules.excludes)
        declared->excludes(declared_option(app, other));
    if (!rules.needs.empty())
        declared->needs(declared_option(app, rules.needs));
}

std::string topic_of(const CLI::Option &option) {
    static const std::vector<std::string> kGeneral{"threads", "max-memory", "quiet", "warnings", "verbose",
                                                   "json",    "log",        "help",  "version"};
    if (option.get_group() != "Options")
        return option.get_group();
    const bool general = std::any_of(kGeneral.begin(), kGeneral.end(),
                                     [&](const std::string &name) { return option.check_lname(name); });
    return general ? "General" : "Options";
}

ProgramHelp describe(const CLI::App &app, std::string_view program, std::span<const OldSwitch> switches,
                     const Manual &manual) {
    const std::string text = app.get_description(), version = app.version(); // "pbm-x 1.2.3"
    const std::size_t line = std::min(text.find('\n'), text.size());
    ProgramHelp help{.program = std::string(program),
                     .version = version.substr(version.rfind(' ') + 1),
                     .summary = text.substr(0, line),
                     .description = line < text.size() ? text.substr(line + 1) : "",
                     .options = {},
                     .manual = manual};
    for (const CLI::Option *option : app.get_options()) {
        if (option->get_group().empty())
            continue;
        OptionHelp entry{.names = {},
                         .value = value_name(*option),
                         .text = option->get_description(),
                         .topic = option->get_positional() ? "" : topic_of(*option),
                         .required = option->get_required(),
                         .several = option->get_items_expected_max() > 1};
        for (const std::string &name : option->get_snames())
            entry.names.push_back("-" + name);
        std::string with_value; // old switches that mean one value of the option
        for (const OldSwitch &old : switches) {
            const std::size_t equals = old.option.find('=');
            if (!old.option.starts_with("--") || !option->check_lname(std::string(old.option.substr(2, equals - 2))))
                continue;
            if (equals == std::string_view::npos)
                entry.names.emplace_back(old.name);
            else
                with_value += "; " + std::string(old.name) + ": " + std::string(old.option.substr(equals + 1));
        }
        for (const std::string &name : option->get_lnames())
            entry.names.push_back("--" + name);
        if (entry.is_positional()) {
            entry.names = {option->get_name(true)};
            entry.value.clear();
        }
        if (const std::string given = option->get_default_str(); !entry.is_positional() && !given.empty())
            entry.text += "; default " + given;
        entry.text += with_value;
        help.options.push_back(std::move(entry));
    }
    return help;
}

// The version if `argument` asks for it. Declaring all options takes a third of the time from start to end of a process
// that only prints it.
const Version *version_asked(const CommandLine &line, std::string_view argument) {
    const auto found = std::find_if(line.options.begin(), line.options.end(), [](const Option &option) {
        return std::holds_alternative<Version>(option.target);
    });
    return found != line.options.end() && (argument == "-V" || argument == "--version")
               ? &std::get<Version>(found->target)
               : nullptr;
}

// The topic after -h or --help; the arguments are reversed.
std::optional<std::string> wanted_topic(const std::vector<std::string> &reversed) {
    for (auto argument = reversed.rbegin(); argument != reversed.rend() && *argument != "--"; ++argument) {
        if (argument->starts_with("--help="))
            return argument->substr(7);
        if (*argument == "-h" || *argument == "--help") {
            const auto next = argument + 1;
            return next == reversed.rend() || next->starts_with("-") ? "" : *next;
        }
    }
    return std::nullopt;
}

// The message on the first remaining word that looks like an option; empty if there is none.
std::string unknown_option(const CLI::App &app, const ProgramHelp &help) {
    for (const std::string &word : app.remaining()) {
        if (word.size() < 2 || word[0] != '-' || word == "--")
            continue;
        const std::string name = word.substr(0, word.find('='));
        std::vector<std::string> known;
        for (const OptionHelp &option : help.options)
            known.insert(known.end(), option.names.begin(), option.names.end());
        const std::string nearest = name.starts_with("--") ? nearest_word(name, known) : "";
        return name + " is not known" + (nearest.empty() ? "" : "; did you mean " + nearest + "?");
    }
    return {};
}

// Rewords "--depth: 1 required INT:INT in [5 - 16] missing" and "--depth: At Most 1 required but received 2".
std::string wrong_count(const CLI::ArgumentMismatch &error) {
    const std::string text = error.what(), name = text.substr(0, text.find(':'));
    if (text.ends_with(" missing"))
        return name + ": its value is missing";
    return text.find(": At Most 1 ") == std::string::npos ? text : name + " is given twice; once is enough";
}

// The message on an empty file name, or on a log that is no separate file; else empty.
std::string unusable_name(const CLI::App &app, const std::string &log) {
    for (const CLI::Option *option : app.get_options()) {
        if (!names_file(*option))
            continue;
        for (const std::string &name : option->results()) {
            if (name.empty() || name == "\"\"")
                return option->get_name() + ": the name of the file is empty";
            if (name.find('\0') != std::string::npos) // the system would take what precedes it
                return option->get_name() + ": the name of the file holds a NUL";
            if (!log.empty() && !option->check_lname("log") && same_file(name, log))
                return log + ": --log and " + option->get_name() + " have this name; choose another name";
        }
    }
    return log == "-" ? "--log: standard output is no log; name a file" : "";
}

// Parses words in reverse order. Returns what is wrong with them, or "". Throws CLI::Success and Refusal.
template <class Help> std::string parse_reversed(CLI::App &app, std::vector<std::string> words, const Help &help) {
    try {
        app.parse(std::move(words));
        return {};
    } catch (const CLI::Success &) {
        throw;
    } catch (const CLI::ArgumentMismatch &error) {
        return wrong_count(error);
    } catch (const CLI::ExtrasError &) {
        const std::string unknown = unknown_option(app, help());
        return !unknown.empty() ? unknown
                                : app.remaining().front() + " is one name too many" +
                                      (app.get_option_no_throw("--output") != nullptr ? "; -o names the output" : "");
    } catch (const CLI::ParseError &error) {
        const std::string unknown = unknown_option(app, help());
        return unknown.empty() ? error.what() : unknown;
    }
}

bool is_flag(const Option &option) {
    return std::holds_alternative<bool *>(option.target) ||
           std::holds_alternative<std::function<void()>>(option.target);
}

// The long names of an option, without dashes.
std::vector<std::string> long_names(const Option &option) {
    std::vector<std::string> names;
    for (const std::string &name : CLI::detail::split(option.names, ','))
        if (name.starts_with("--"))
            names.push_back(name.substr(2));
    return names;
}

const Option *find_option(const CommandLine &line, const std::string &name) {
    const auto found = std::find_if(line.options.begin(), line.options.end(), [&](const Option &option) {
        const std::vector<std::string> names = long_names(option);
        return std::find(names.begin(), names.end(), name) != names.end();
    });
    return found == line.options.end() ? nullptr : &*found;
}

Error unknown_name(const CommandLine &line, const std::string &name) {
    std::vector<std::string> known;
    for (const Option &option : line.options)
        for (std::string &other : long_names(option))
            known.push_back(std::move(other));
    const std::string nearest = nearest_word(name, known);
    return usage_error("there is no option '" + name + "'" +
                       (nearest.empty() ? "" : "; did you mean '" + nearest + "'?"));
}

int print_help(const CommandLine &line, ProgramHelp help, const std::string &topic) {
    for (OptionHelp &entry : help.options)
        for (const std::string &name : entry.names)
            if (const Option *const option = name.starts_with("--") ? find_option(line, name.substr(2)) : nullptr;
                option != nullptr && option->rules.proposals)
                entry.proposals = option->rules.proposals();
    if (const auto script = completion_script(help, topic)) {
        print_text(*script);
        return 0;
    }
    const auto page = help_page(help, topic);
    if (!page)
        return fail_usage(help.program, page.error().message);
    print_text(*page);
    return 0;
}

std::vector<GivenValue> given_values(const CLI::App &app) {
    const auto settings = std::dynamic_pointer_cast<SettingsReader>(app.get_config_formatter());
    std::vector<GivenValue> given;
    for (const CLI::Option *option : app.get_options())
        for (const std::string &value : option->results())
            given.push_back({.name = option->get_name(),
                             .topic = option->get_group(),
                             .type = value_name(*option),
                             .value = value,
                             .is_file = names_file(*option, value),
                             .is_setting = settings && settings->has_set(option)});
    return given;
}

} // namespace

void CommandLine::add(std::string names, std::string help, Target target, OptionRules rules) {
    if (rules.topic.empty())
        rules.topic = topic;
    options.push_back({std::move(names), std::move(help), std::move(target), std::move(rules)});
}

void CommandLine::add_version(const std::string &version) {
    add("-V,--version", "The program's name and version", Version{program + " " + version});
}

bool is_below(const std::string &file, const std::string &settings) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    constexpr int kMaxLinks = 40;
    fs::path name = file;
    for (int i = 0; i < kMaxLinks && fs::is_symlink(name, ignored); ++i) // weakly_canonical keeps links to nothing
        name = name.parent_path() / fs::read_symlink(name, ignored);
    const fs::path full = fs::weakly_canonical(fs::absolute(name, ignored), ignored);
    const fs::path parent = fs::path(settings).parent_path();
    const fs::path folder = fs::canonical(parent.empty() ? fs::path(".") : parent, ignored);
    return !folder.empty() &&
           std::mismatch(folder.begin(), folder.end(), full.begin(), full.end()).first == folder.end();
}

std::optional<int> parse(CommandLine &line, int argc, char **argv, std::span<const OldSwitch> switches,
                         const Manual &manual) {
    const std::string &program = line.program;
    if (const Version *version = argc == 2 ? version_asked(line, argv[1]) : nullptr) {
        std::cout << version->text << '\n';
        return 0;
    }
    CLI::App app{line.description, program};
    for (const Option &option : line.options)
        declare(app, option);
    app.option_defaults()->group(line.topic);
    app.set_help_flag();
    app.add_option("--log")->type_name("FILE")->description(
        std::string("Add errors and warnings to FILE, a line each") +
        (manual.logs_steps ? "; the steps too with -v" : ""));
    bool asked = false;
    app.add_flag("-h,--help", asked, "This page, that of a TOPIC, or all");
    const auto help = [&] { return describe(app, program, switches, manual); };
    auto given = arguments(argc, argv, switches);
    if (!given)
        return fail(program, "", given.error());
    if (const auto topic = wanted_topic(*given))
        return print_help(line, help(), *topic);

    std::optional<Refusal> refusal;
    std::string problem;
    try {
        problem = parse_reversed(app, std::move(given).value(), help);
    } catch (const CLI::Success &done) {
        return app.exit(done);
    } catch (const Refusal &thrown) {
        refusal = thrown;
    }
    if (asked)
        return print_help(line, help(), "");
    const std::string log = first_result(app.get_option("--log"));
    set_json_path(first_result(app.get_option_no_throw("--json")));
    const std::string unusable = unusable_name(app, log);
    if (!log.empty() && unusable.empty())
        if (const Status opened = open_log(program, log); !opened)
            return fail(program, log, opened.error());
    if (refusal)
        return fail(program, refusal->path, refusal->error);
    if (!problem.empty() || !unusable.empty())
        return fail_usage(program, unusable.empty() ? problem : unusable);
    for (const CLI::Option *option : app.get_options())
        if (option->get_positional())
            work_on(first_result(option));
    line.given = given_values(app);
    return std::nullopt;
}

Result<std::vector<std::string>> words_of(const CommandLine &line, std::span<const NamedValue> options) {
    std::vector<std::string> words;
    for (const NamedValue &given : options) {
        const Option *const option = find_option(line, given.name);
        if (option == nullptr)
            return unknown_name(line, given.name);
        if (!is_flag(*option)) {
            words.push_back("--" + given.name + (given.value ? "=" + *given.value : ""));
            continue;
        }
        if (given.value && *given.value != "true" && *given.value != "false")
            return usage_error("'" + given.name + "' is true or false");
        if (given.value != "false")
            words.push_back("--" + given.name);
    }
    return words;
}

Status parse_words(CommandLine &line, std::vector<std::string> words) {
    CLI::App app{line.description, line.program};
    for (const Option &option : line.options)
        declare(app, option);
    app.set_help_flag();
    std::reverse(words.begin(), words.end());
    try {
        std::string problem =
            parse_reversed(app, std::move(words), [&] { return describe(app, line.program, {}, {}); });
        if (problem.empty())
            problem = unusable_name(app, "");
        if (!problem.empty())
            return usage_error(problem);
    } catch (const CLI::Success &) {
        return usage_error("help and version are of programs");
    } catch (const Refusal &refusal) {
        return Error{refusal.error.code, refusal.error.offset, refusal.path + ": " + refusal.error.message};
    }
    line.given = given_values(app);
    return {};
}

} // namespace pbm::command_line
