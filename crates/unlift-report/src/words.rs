//! Numbers and names in words: thresholds, shares, ratios, schemes, reasons.

use std::borrow::Borrow;
use std::fmt::Display;

use unlift::Unit;
use unlift::audit::Interval;
use unlift::obfuscate::{self, Entry};

/// Returns what is known of a scheme, without its changes to the map (`olc_thin4` is `olc`); `None` for schemes of others.
pub(crate) fn facts(scheme: &str) -> Option<&'static Entry> {
    obfuscate::all().find(|entry| entry.name == base(scheme))
}

fn base(scheme: &str) -> &str {
    scheme.split('_').next().unwrap_or(scheme)
}

/// Returns the title of a scheme, with its changes to the map: `olc_thin4` is "Random lines, thin4". An unknown scheme keeps its name.
pub(crate) fn scheme_title(scheme: &str) -> String {
    match facts(scheme) {
        Some(facts) => scheme.replace('_', ", ").replacen(base(scheme), facts.title, 1),
        None => scheme.to_owned(),
    }
}

/// Returns whether a scheme of ours has a mitigation or protected descriptors: `olc_thin4`.
pub(crate) fn is_changed(scheme: &str) -> bool {
    facts(scheme).is_some() && base(scheme) != scheme
}

/// Returns a sentence on what a scheme publishes in place of a point; empty for unknown schemes.
pub(crate) fn scheme_rule(scheme: &str) -> &'static str {
    facts(scheme).map_or("", |facts| facts.rule)
}

/// Returns a percentage as a part in words: "nearly half".
pub(crate) fn part(percent: f64) -> &'static str {
    match percent {
        95.0.. => "nearly all",
        55.0.. => "more than half",
        50.0.. => "half",
        45.0.. => "nearly half",
        36.0.. => "more than a third",
        32.5.. => "a third",
        30.0.. => "nearly a third",
        _ => "a fifth or more",
    }
}

/// The unit of a map without a scale, in words; the page defines it once.
pub(crate) const USUAL_DISTANCE: &str = "the median distance to the K-th neighbor";

/// Returns the sign of a unit on the page; × is times [`USUAL_DISTANCE`].
pub(crate) fn sign(unit: Unit) -> &'static str {
    match unit {
        Unit::Meter => "m",
        Unit::KthNeighbor => "×",
        Unit::Pixel => "px",
    }
}

/// Returns a threshold in short form: `10 cm`, `2.5×`, `10 px`.
pub(crate) fn threshold(typed: &str, unit: Unit) -> String {
    match (unit, typed.parse::<f64>()) {
        (Unit::Meter, Ok(meters)) => meters_text(meters),
        (Unit::KthNeighbor, Ok(times)) => format!("{times}×"),
        _ => format!("{typed} {}", sign(unit)),
    }
}

/// Returns a length in words: centimeters below a meter, pixels, or multiples of the unit.
pub(crate) fn length(value: f64, unit: Unit) -> String {
    match unit {
        Unit::Meter => meters_text(value),
        Unit::KthNeighbor => format!("{}×", grouped(value)),
        Unit::Pixel => format!("{} px", grouped(value)),
    }
}

fn meters_text(meters: f64) -> String {
    if meters >= 1.0 {
        format!("{} m", grouped(meters))
    } else if meters >= 0.01 || meters == 0.0 {
        format!("{} cm", significant(meters * 100.0, 3))
    } else {
        format!("{} mm", significant(meters * 1000.0, 3))
    }
}

fn grouped(value: f64) -> String {
    let text = significant(value, 3);
    match text.parse::<u64>() {
        Ok(whole) => thousands(whole),
        Err(_) => text,
    }
}

/// Rounds to significant decimal digits; zero and non-finite values stay unchanged.
pub(crate) fn rounded(value: f64, digits: usize) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    // Rounding through decimal text is exact; `(value * 10^n).round() / 10^n` leaves a tail of nines.
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

pub(crate) fn significant(value: f64, digits: usize) -> String {
    rounded(value, digits).to_string()
}

pub(crate) fn percent(value: f64) -> String {
    format!("{value:.1}")
}

/// Returns the cell of a percentage in a terminal: "46.6 %", or a dash.
pub(crate) fn percent_or_dash(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.1} %"))
}

/// Returns the ends of an interval: "45.9 to 47.3".
pub(crate) fn interval([low, high]: Interval) -> String {
    format!("{} to {}", percent(low), percent(high))
}

/// Returns "if half of the neighbors were known", for any inlier ratio.
pub(crate) fn if_known(ratio: f64) -> String {
    let common = [
        (1.0, "if all neighbors were known"),
        (0.75, "if three of four neighbors were known"),
        (0.5, "if half of the neighbors were known"),
        (0.25, "if one neighbor in four was known"),
        (0.2, "if one neighbor in five was known"),
        (0.1, "if one neighbor in ten was known"),
    ];
    match common.iter().find(|(value, _)| (value - ratio).abs() < 1e-9) {
        Some((_, words)) => (*words).to_owned(),
        None => format!("if {} % of the neighbors were known", ratio_percent(ratio)),
    }
}

pub(crate) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Joins items: "a, b and c".
pub(crate) fn list<S: Borrow<str> + Display>(items: &[S]) -> String {
    match items {
        [] => String::new(),
        [item] => item.to_string(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Returns an inlier ratio as a percentage of two digits without the sign; only 1 gives 100.
pub(crate) fn ratio_percent(ratio: f64) -> String {
    match ratio {
        0.999..1.0 => "99.9".to_owned(),
        0.99..1.0 => significant(ratio * 100.0, 3),
        _ => significant(ratio * 100.0, 2),
    }
}

/// Returns a count with thousands grouped: "21,149" for 21149.
pub(crate) fn thousands(count: impl Display) -> String {
    let digits: Vec<char> = count.to_string().chars().collect();
    digits.rchunks(3).rev().map(String::from_iter).collect::<Vec<_>>().join(",")
}

/// Returns an ordinal number: "50th" for 50.
pub(crate) fn ordinal(number: usize) -> String {
    let ending = match (number % 10, number % 100) {
        (_, 11..=13) => "th",
        (1, _) => "st",
        (2, _) => "nd",
        (3, _) => "rd",
        _ => "th",
    };
    format!("{number}{ending}")
}

/// Returns a duration in words: `0.42 s`, `38 s`, `4 min 10 s`.
pub(crate) fn seconds(value: f64) -> String {
    if value < 60.0 {
        return format!("{} s", significant(value, 2));
    }
    let whole = value.round() as u64;
    format!("{} min {} s", whole / 60, whole % 60)
}

pub(crate) fn bytes(count: u64) -> String {
    let value = count as f64;
    if value < 1e9 {
        format!("{:.0} MB", (value / 1e6).ceil())
    } else {
        format!("{} GB", significant(value / 1e9, 3))
    }
}

/// Aligns rows of text: columns are as wide as their widest cell and two spaces apart; those in `left` are flush left, others flush right.
pub fn align(rows: &[Vec<String>], left: &[usize]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let aligned = |(column, (cell, width)): (usize, (&String, &usize))| {
        if left.contains(&column) {
            format!("{cell:<width$}  ")
        } else {
            format!("{cell:>width$}  ")
        }
    };
    let line = |row: &Vec<String>| {
        let line: String = row.iter().zip(&widths).enumerate().map(aligned).collect();
        line.trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_digits_are_kept_at_any_magnitude() {
        for (value, expected) in [
            (1.234_567_89, 1.234_57),
            (89.123_456_7, 89.123_5),
            (1.234_567_89e-9, 1.234_57e-9),
            (-0.1 - 0.2, -0.3),
            (0.0, 0.0),
        ] {
            assert_eq!(rounded(value, 6), expected);
        }
    }

    #[test]
    fn centimeters_need_meters() {
        assert_eq!(threshold("0.10", Unit::Meter), "10 cm");
        assert_eq!(threshold("0.005", Unit::Meter), "5 mm");
        assert_eq!(threshold("2.5", Unit::Meter), "2.5 m");
        assert_eq!(threshold("1.0", Unit::KthNeighbor), "1×");
        assert_eq!(threshold("2.50", Unit::KthNeighbor), "2.5×");
        assert_eq!(length(0.34567, Unit::KthNeighbor), "0.346×");
        assert_eq!(threshold("10", Unit::Pixel), "10 px");
        assert_eq!(length(3.4567, Unit::Pixel), "3.46 px");
        assert_eq!(length(1284.2, Unit::Pixel), "1,280 px");
        assert_eq!(length(12_345.0, Unit::Meter), "12,300 m");
    }
}
