// What the models of `virga model` share: each answers with one set of numbers, which is printed as a table, as JSON or
// as charts. docs/model.md describes every field.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "Command.h"
#include "plot/Chart.h"

namespace virga::cli {

/// Lists of the object that are printed beside each other, a row an element.
struct Columns {
    std::vector<std::string> fields;
    std::string counter = {};  ///< heading of a column that counts the rows; empty: none
    int first = 0;             ///< the first row's number
};

struct Answer {
    nlohmann::ordered_json object;  ///< field names carry their units
    std::vector<Columns> columns;   ///< which lists the table shows, in this order; numbers and words come before them
    std::function<std::vector<plot::Chart>()> charts;  ///< made where they are asked for
};

/// A model has flags of its own and one function from them to its answer.
struct Model {
    const char* name;
    const char* help;
    const char* examples;
    /// Adds the flags; what it returns is called when the model was chosen, and may throw Error.
    std::function<std::function<Answer()>(CLI::App& command)> add;
};

std::vector<Model> opticsModels();    ///< transfer, fresnel, shape, airlight
std::vector<Model> rainModels();      ///< velocity, sizes, extinction
std::vector<Model> radianceModels();  ///< radiance

// Flags. What is wrong with them is said in a sentence with the flag, the value and what is allowed: Error(2).

struct NumberRange {
    double low, high;
    const char* unit = "";  ///< "deg"
    bool openLow = false;   ///< low itself is not allowed
};

/// Adds `--flag` for one number, `value` when it is not given.
CLI::Option* addNumber(CLI::App& command, const std::string& flag, double& value, const NumberRange& range,
                       const std::string& help);

/// Adds `--flag a,b,...`: at least one number, `values` when it is not given.
CLI::Option* addNumbers(CLI::App& command, const std::string& flag, std::vector<double>& values,
                        const NumberRange& range, const std::string& help);

/// Adds `--flag N` for a whole number from low to high; if `word` is not empty, that word stands for `wordValue`.
CLI::Option* addWhole(CLI::App& command, const std::string& flag, int& value, int low, int high,
                      const std::string& help, const std::string& word = {}, int wordValue = 0);

/// `count` values from `from` to `to`, both among them, at equal steps.
std::vector<double> steps(double from, double to, int count);
/// The same at equal ratios.
std::vector<double> ratios(double from, double to, int count);

}  // namespace virga::cli
