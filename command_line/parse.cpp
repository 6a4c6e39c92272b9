#include "command_line/parse.h"

#include "system/files/mapped_file.h"

#include <algorithm>
#include <iostream>

namespace pbm::command_line {

bool names_file(const CLI::Option &option) {
    return option.get_positional() || option.check_lname("output") ||
           option.get_type_name().find("FILE") != std::string::npos;
}

bool names_file(const CLI::Option &option, const std::string &value) {
    const std::vector<std::string> words = CLI::detail::split(option.get_type_name(), '|');
    return names_file(option) && (words.size() == 1 || std::count(words.begin() + 1, words.end(), value) == 0);
}

namespace detail {

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

} // namespace detail

namespace {

std::string topic_of(const CLI::Option &option) {
    static const std::vector<std::string> kGeneral{"threads", "max-memory", "quiet", "verbose",
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
                     .most_used = manual.most_used,
                     .examples = manual.examples,
                     .run_time_limits = manual.run_time_limits};
    for (const CLI::Option *option : app.get_options()) {
        if (option->get_group().empty())
            continue;
        OptionHelp entry{.names = {},
                         .value = detail::value_name(*option),
                         .text = option->get_description(),
                         .topic = topic_of(*option),
                         .needs_name = !option->get_positional(),
                         .required = option->get_required(),
                         .several = option->get_items_expected_max() > 1};
        for (const std::string &name : option->get_snames())
            entry.names.push_back("-" + name);
        std::string with_value; // an old switch that stands for one value of the option
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
        if (!entry.needs_name) {
            entry.names = {option->get_name(true)};
            entry.value.clear();
        }
        if (const std::string given = option->get_default_str(); entry.needs_name && !given.empty())
            entry.text += "; default " + given;
        entry.text += with_value;
        help.options.push_back(std::move(entry));
    }
    return help;
}

// The topic after -h or --help; arguments are reversed.
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

// What is wrong with the first word that nothing took and that looks like an option; empty without one.
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

// CLI11 says "--depth: 1 required INT:INT in [5 - 16] missing" and "--depth: At Most 1 required but received 2".
std::string wrong_count(const CLI::ArgumentMismatch &error) {
    const std::string text = error.what(), name = text.substr(0, text.find(':'));
    if (text.ends_with(" missing"))
        return name + ": its value is missing";
    return text.find(": At Most 1 ") == std::string::npos ? text : name + " is given twice; once is enough";
}

// A name that is empty, or a log that is no file of its own.
std::string unusable_name(const CLI::App &app, const std::string &log) {
    for (const CLI::Option *option : app.get_options()) {
        if (!names_file(*option))
            continue;
        for (const std::string &name : option->results()) {
            if (name.empty() || name == "\"\"")
                return option->get_name() + ": the name of the file is empty";
            if (!log.empty() && !option->check_lname("log") && same_file(name, log))
                return log + ": the log is another file of this command line; choose another name";
        }
    }
    return log == "-" ? "--log: standard output is no log; name a file" : "";
}

int print_help(const ProgramHelp &help, const std::string &topic) {
    const auto page = help_page(help, topic);
    if (!page)
        return fail_usage(help.program, page.error().message);
    std::cout << *page;
    return 0;
}

} // namespace

std::optional<int> parse(CLI::App &app, std::string_view program, int argc, char **argv,
                         std::span<const OldSwitch> switches, const Manual &manual) {
    app.set_help_flag();
    app.add_option("--log")->type_name("FILE")->description(
        std::string("Add errors and warnings to FILE, a line each") +
        (manual.logs_steps ? "; the steps too with -v" : ""));
    if (CLI::Option *const version = app.get_version_ptr(); version != nullptr)
        version->description("The program's name and version");
    bool asked = false;
    app.add_flag("-h,--help", asked, "This page, that of a TOPIC, or all");
    const ProgramHelp help = describe(app, program, switches, manual);
    auto given = arguments(argc, argv, switches);
    if (!given)
        return fail(program, "", given.error());
    if (const auto topic = wanted_topic(*given))
        return print_help(help, *topic);

    std::optional<Refusal> refusal;
    std::string problem;
    try {
        app.parse(std::move(given).value());
    } catch (const CLI::Success &done) {
        return app.exit(done);
    } catch (const Refusal &thrown) {
        refusal = thrown;
    } catch (const CLI::FileError &error) {
        const std::string path = detail::first_result(app.get_config_ptr());
        const auto file = MappedFile::open(path);
        refusal = Refusal{path, file ? Error{ErrorCode::io, 0, error.what()} : file.error()};
    } catch (const CLI::ArgumentMismatch &error) {
        problem = wrong_count(error);
    } catch (const CLI::ParseError &error) {
        const std::string unknown = unknown_option(app, help);
        problem = unknown.empty() ? error.what() : unknown;
    }
    if (asked)
        return print_help(help, "");
    const std::string log = detail::first_result(app.get_option("--log"));
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
            work_on(detail::first_result(option));
    return std::nullopt;
}

} // namespace pbm::command_line
