//! Turns a configuration into command lines, so that options are defined only once.

use std::ops::Range;

use clap::{Arg, ArgAction, CommandFactory};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::args::Cli;

/// Kinds of audits, in configurations and on the command line.
const KINDS: [&str; 3] = ["map", "images", "released"];
/// Key of the positional argument.
const PATH: &str = "path";
/// Options that a configuration cannot set, because `check` decides what is printed.
const NO_KEYS: [&str; 2] = ["help", "json"];

#[derive(Debug, PartialEq, Eq)]
pub struct Entry {
    pub kind: &'static str,
    /// First line of the entry.
    pub line: usize,
    /// Path of the map, images or records.
    pub path: String,
    /// The command line, including the name of the program.
    pub words: Vec<String>,
}

/// An error in a configuration, with its line.
#[derive(Debug, PartialEq, Eq)]
pub struct Wrong {
    pub line: usize,
    pub what: String,
}

/// Reads the audits of a configuration, in order.
pub fn read(text: &str, quiet: bool) -> Result<Vec<Entry>, Wrong> {
    let line = |span: Range<usize>| 1 + text[..span.start].matches('\n').count();
    let wrong = |span, what: String| Wrong { line: line(span), what };
    let whole = DeTable::parse(text).map_err(|error| {
        let message = error.message().trim().replace('\n', ", ");
        wrong(error.span().unwrap_or(0..0), message)
    })?;
    let mut entries = Vec::new();
    for (key, value) in whole.get_ref() {
        let Some(kind) = KINDS.into_iter().find(|kind| *kind == key.get_ref().as_ref()) else {
            let known = KINDS.map(|kind| format!("[[{kind}]]")).join(", ");
            return Err(wrong(
                key.span(),
                format!("expected one of {known}, found {}", key.get_ref()),
            ));
        };
        let tables = value.get_ref().as_array().filter(|array| !array.is_empty());
        let tables = tables.ok_or_else(|| {
            wrong(key.span(), format!("{kind}: expected tables, [[{kind}]], found {}", said(value)))
        })?;
        for table in tables.iter() {
            let fields = table.get_ref().as_table().ok_or_else(|| {
                wrong(
                    table.span(),
                    format!("{kind}: expected tables, [[{kind}]], found {}", said(table)),
                )
            })?;
            let at = table.span();
            let (path, words) = entry(kind, fields, at.clone(), quiet)
                .map_err(|(span, what)| wrong(span, format!("[[{kind}]]: {what}")))?;
            entries.push((at.start, Entry { kind, line: line(at), path, words }));
        }
    }
    if entries.is_empty() {
        let known = KINDS.map(|kind| format!("[[{kind}]]")).join(", ");
        return Err(wrong(0..0, format!("expected one of {known}, found none")));
    }
    // The parser groups entries by kind: restore the order of the file.
    entries.sort_by_key(|(start, _)| *start);
    Ok(entries.into_iter().map(|(_, entry)| entry).collect())
}

type Misplaced = (Range<usize>, String);

/// Converts one entry to its path and command line.
fn entry(
    kind: &str,
    fields: &DeTable<'_>,
    at: Range<usize>,
    quiet: bool,
) -> Result<(String, Vec<String>), Misplaced> {
    let command = Cli::command();
    let audit = command.find_subcommand("audit").and_then(|audit| audit.find_subcommand(kind));
    let options: Vec<&Arg> = audit.into_iter().flat_map(|audit| audit.get_arguments()).collect();
    let options = options.into_iter().filter_map(|arg| Some((arg.get_long()?, arg)));
    let options: Vec<(&str, &Arg)> = options.filter(|(long, _)| !NO_KEYS.contains(long)).collect();
    let mut path = None;
    let mut words: Vec<String> = ["unlift", "audit", kind].map(str::to_owned).to_vec();
    for (key, value) in fields {
        let name = key.get_ref().as_ref();
        if name == PATH {
            let text = value.get_ref().as_str();
            let text = text.ok_or_else(|| {
                (key.span(), format!("{PATH}: expected text, found {}", said(value)))
            })?;
            path = Some(text.to_owned());
        } else if let Some((long, arg)) = options.iter().find(|(long, _)| *long == name) {
            let typed = typed(long, arg, value);
            words.extend(typed.map_err(|what| (key.span(), format!("{long}: {what}")))?);
        } else {
            let known: Vec<&str> =
                [PATH].into_iter().chain(options.iter().map(|(long, _)| *long)).collect();
            return Err((
                key.span(),
                format!("expected one of {}, found {name}", known.join(", ")),
            ));
        }
    }
    let path = path.ok_or_else(|| (at, format!("expected a {PATH}, found none")))?;
    if quiet && !words.iter().any(|word| word == "--quiet") {
        words.push("--quiet".to_owned());
    }
    // After `--`, a path that begins with a dash is no option.
    words.extend(["--".to_owned(), path.clone()]);
    Ok((path, words))
}

/// Converts an option and its value to words of a command line.
fn typed(long: &str, arg: &Arg, value: &Spanned<DeValue<'_>>) -> Result<Vec<String>, String> {
    let is_flag = matches!(arg.get_action(), ArgAction::SetTrue);
    // `--outlier-filter` has a default value when given alone.
    let may_be_flag = arg.get_num_args().is_some_and(|n| n.min_values() == 0);
    match value.get_ref() {
        DeValue::Boolean(set) if is_flag || may_be_flag => {
            Ok(if *set { vec![format!("--{long}")] } else { Vec::new() })
        }
        _ if is_flag => Err(format!("expected true or false, found {}", said(value))),
        DeValue::Array(items) if matches!(arg.get_action(), ArgAction::Append) => {
            let word = |item: &Spanned<DeValue<'_>>| {
                let text = text(item.get_ref());
                let wrong = || format!("expected text or numbers, found {}", said(item));
                text.map(|text| format!("--{long}={text}")).ok_or_else(wrong)
            };
            items.iter().map(word).collect()
        }
        one => match text(one) {
            Some(text) => Ok(vec![format!("--{long}={text}")]),
            None => Err(format!("expected text or a number, found {}", said(value))),
        },
    }
}

/// Returns a value as typed: numbers keep their digits, because thresholds are also names.
fn text(value: &DeValue<'_>) -> Option<String> {
    match value {
        DeValue::String(text) => Some(text.to_string()),
        DeValue::Integer(number) if number.radix() == 10 => Some(number.as_str().to_owned()),
        DeValue::Float(number) => Some(number.as_str().to_owned()),
        _ => None,
    }
}

/// Describes a value for an error message.
fn said(value: &Spanned<DeValue<'_>>) -> String {
    let value = value.get_ref();
    match text(value) {
        Some(text) => text,
        None if value.as_bool().is_some() => format!("{}", value.as_bool() == Some(true)),
        None => format!("a value of type {}", value.type_str()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        let entries = read(text, false).unwrap();
        assert_eq!(entries.len(), 1);
        entries.into_iter().flat_map(|entry| entry.words).skip(3).collect()
    }

    fn wrong(text: &str) -> (usize, String) {
        let wrong = read(text, false).unwrap_err();
        (wrong.line, wrong.what)
    }

    #[test]
    fn keys_are_options() {
        let text = "[[map]]\npath = \"-m\"\nk = 10\nthresholds = [0.10, 0.250]\nschemes = \"ppl,ppl+\"\n\
                    gate = [\"all:0.10<=20\"]\nshare-safe = true\nforce = false\noutlier-filter = true\n";
        let mut words = words(text);
        assert_eq!(words.split_off(words.len() - 2), ["--", "-m"]);
        words.sort();
        let expected = [
            "--gate=all:0.10<=20",
            "--k=10",
            "--outlier-filter",
            "--schemes=ppl,ppl+",
            "--share-safe",
            "--thresholds=0.10",
            "--thresholds=0.250",
        ];
        assert_eq!(words, expected);
        assert!(read(text, true).unwrap()[0].words.contains(&"--quiet".to_owned()));
    }

    #[test]
    fn audits_keep_the_order_of_the_file() {
        let text = "[[released]]\npath = \"a\"\ntruth = \"t\"\n[[map]]\npath = \"b\"\n\n[[images]]\npath = \"c\"\n\
                    [[map]]\npath = \"d\"\n";
        let entries = read(text, false).unwrap();
        let order: Vec<(&str, usize, &str)> =
            entries.iter().map(|entry| (entry.kind, entry.line, entry.path.as_str())).collect();
        assert_eq!(
            order,
            [("released", 1, "a"), ("map", 4, "b"), ("images", 7, "c"), ("map", 9, "d")]
        );
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        let (line, what) = wrong("[[map]]\npath = \"a\"\n\nscal = 1\n");
        assert!(line == 4 && what.starts_with("[[map]]: expected one of path, scale, "), "{what}");
        assert!(what.ends_with(", found scal") && !what.contains("json") && what.contains("junit"));
        assert_eq!(
            wrong("[[maps]]\n").1,
            "expected one of [[map]], [[images]], [[released]], found maps"
        );
        assert_eq!(wrong("").1, "expected one of [[map]], [[images]], [[released]], found none");
        assert_eq!(wrong("\n[map]\npath = \"a\"\n").0, 2);
        assert_eq!(wrong("\n[[map]]\nk = 1\n"), (2, "[[map]]: expected a path, found none".into()));
        let flag = "[[map]]: share-safe: expected true or false, found yes".to_owned();
        assert_eq!(wrong("[[map]]\nshare-safe = \"yes\"\n"), (2, flag));
        let one =
            "[[map]]: scale: expected text or a number, found a value of type array".to_owned();
        assert_eq!(wrong("[[map]]\nscale = [1]\n"), (2, one));
        let (line, what) = wrong("[[map]]\npath = \n");
        assert!(line == 2 && !what.contains('\n') && !what.is_empty(), "{line}: {what}");
    }
}
