// Options from a file: what the command line does not say, a file of settings may. Included by options.cpp files only.
#pragma once

#include "command_line/parse.h"
#include "command_line/setting.h"

namespace pbm::command_line {

namespace detail {

// CLI11 asks for the settings when it has read the command line and before it looks for what is missing.
class SettingsFile : public CLI::Config {
  public:
    SettingsFile(CLI::App &app, ReadSettings read) : app_(app), read_(std::move(read)) {}

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
                throw Refusal{path, {ErrorCode::usage, 0, "line " + std::to_string(setting.line) + ": " + wrong}};
        return {};
    }

  private:
    static bool contains(const std::vector<const CLI::Option *> &options, const CLI::Option *option) {
        return std::find(options.begin(), options.end(), option) != options.end();
    }

    static std::vector<std::string> keys_of(const CLI::Option &option) {
        if (option.check_lname("help") || option.check_lname("version"))
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

    // Names of files are relative to the folder of the file that says them.
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

    // What is wrong with the setting, or nothing. The command line wins over it, and over what excludes it.
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
        try {
            for (const std::string &value : values_of(setting, *option, path))
                option->add_result(value);
            option->run_callback();
        } catch (const CLI::ParseError &error) {
            return error.what();
        }
        return {};
    }

    CLI::App &app_;
    ReadSettings read_;
};

} // namespace detail

// Adds `option FILE`, which reads settings with `read`. Every long option of `app` is a key, whenever it is added.
// Unknown keys and values of a wrong type are refused, naming the line.
inline CLI::Option *add_settings_file(CLI::App &app, const std::string &option, const std::string &text,
                                      ReadSettings read) {
    app.config_formatter(std::make_shared<detail::SettingsFile>(app, std::move(read)));
    return app.set_config(option, "", text)->type_name("FILE");
}

} // namespace pbm::command_line
