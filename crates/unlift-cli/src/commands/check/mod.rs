//! `unlift check`: runs the audits of a configuration.

mod config;

use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use unlift::OneLine;
use unlift_audit::{FIGURES, Finished, PAGE};
use unlift_io::Error;
use unlift_io::atomic::{Rules, place_of};
use unlift_report::gate_found;

use self::config::Entry;
use super::common::all_could_be;
use super::{audit_again, audit_images, audit_map, audit_released, audit_sequence};
use crate::args::{AuditCommand, CheckArgs, Cli, Command, ResultArgs};
use crate::exit::{self, Outcome, usage};
use crate::output::print;
use crate::stderr::tell;

pub fn run(args: &CheckArgs) -> anyhow::Result<Outcome> {
    let config = args.config.display().to_string();
    let mut text = String::new();
    let (mut file, _) = unlift_io::input::open(&args.config)?;
    file.read_to_string(&mut text).map_err(|error| Error::read(&args.config, error))?;
    let at = |line: usize, what: &str| format!("{config}:{line}: {what}");
    let entries = config::read(&text, args.quiet)
        .map_err(|wrong| usage(at(wrong.line, &OneLine(&wrong.what).to_string())))?;
    let place = |entry: &Entry| at(entry.line, &format!("[[{}]]", entry.kind));
    let mut audits = Vec::new();
    for entry in &entries {
        let audit = parsed(entry).map_err(|what| usage(format!("{}: {what}", place(entry))))?;
        audits.push((entry, audit));
    }
    // All paths are relative to the configuration.
    let folder = match args.config.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new(""),
    };
    if !folder.as_os_str().is_empty() {
        std::env::set_current_dir(folder).map_err(|error| Error::read(folder, error))?;
    }
    let read = audits.iter().flat_map(|(_, audit)| inputs(audit));
    let rules = Rules::new(read.chain(args.config.file_name().map(Path::new)), true);
    apart(&audits, &rules, place)?;
    let (mut failed, mut worst, mut undone) = (false, 0, 0);
    for (entry, audit) in &audits {
        match perform(audit) {
            Ok(finished) => {
                failed |= !finished.passed();
                print(&format!("{}\n", OneLine(told(entry, &finished, folder))))?;
            }
            // The other audits still run.
            Err(error) => {
                let error = Err::<(), _>(error).context(place(entry)).unwrap_err();
                exit::lines(&error).iter().for_each(tell);
                worst = worst.max(exit::code(&error));
                undone += 1;
            }
        }
    }
    match worst {
        0 if failed => Ok(Outcome::GateFailed),
        0 => Ok(Outcome::Done),
        worst => {
            let line = format!("{config}: {undone} of {} audits failed to run", audits.len());
            Err(if worst == exit::USAGE { usage(line) } else { anyhow!(line) })
        }
    }
}

fn parsed(entry: &Entry) -> Result<AuditCommand, String> {
    match Cli::read(&entry.words) {
        Ok(Cli { command: Command::Audit(audit), .. }) => Ok(audit),
        // The words always begin with `audit`.
        Ok(_) => Err("expected an audit, found another command".to_owned()),
        Err(error) => {
            let text = error.to_string();
            // Drop clap's usage text, which is about the command line.
            let said = text.lines().take_while(|line| !line.trim().is_empty());
            let said: Vec<&str> = said.map(str::trim).collect();
            Err(OneLine(said.join(" ").trim_start_matches("error: ")).to_string())
        }
    }
}

fn result(audit: &AuditCommand) -> &ResultArgs {
    match audit {
        AuditCommand::Map(args) => &args.result,
        AuditCommand::Images(args) => &args.result,
        AuditCommand::Released(args) => &args.result,
        AuditCommand::Sequence(args) => &args.result,
        AuditCommand::Again(args) => &args.result,
    }
}

fn inputs(audit: &AuditCommand) -> Vec<&Path> {
    match audit {
        AuditCommand::Map(args) => audit_map::inputs(args),
        AuditCommand::Images(args) => audit_images::inputs(args),
        AuditCommand::Released(args) => audit_released::inputs(args),
        AuditCommand::Sequence(args) => audit_sequence::inputs(args),
        AuditCommand::Again(args) => audit_again::inputs(args),
    }
}

/// Returns an error if two audits write to the same place, or if one overwrites an input of any
/// audit or the configuration.
fn apart(
    audits: &[(&Entry, AuditCommand)],
    rules: &Rules,
    place: impl Fn(&Entry) -> String,
) -> anyhow::Result<()> {
    let mut taken: Vec<(PathBuf, usize)> = Vec::new();
    for (at, (entry, audit)) in audits.iter().enumerate() {
        let result = result(audit);
        let files = [("junit", &result.junit)];
        let files = files.into_iter().filter_map(|(key, path)| Some((key, path.as_ref()?, None)));
        let own = [PAGE, FIGURES].map(|name| ("out", &result.out, Some(name)));
        for (key, path, name) in own.into_iter().chain(files) {
            let file = name.map_or(path.clone(), |name| path.join(name));
            let wrong = |expected: &str, found: String| {
                usage(format!("{}: {key}: expected {expected}, found {found}", place(entry)))
            };
            if let Some(input) = rules.input_at(&file) {
                let found = format!("{}, the input {}", file.display(), input.display());
                return Err(wrong("a file that is not read", found));
            }
            let target = place_of(&file);
            if let Some((_, other)) = taken.iter().find(|(taken, by)| *taken == target && *by != at)
            {
                let (path, line) = (path.display(), audits[*other].0.line);
                return Err(wrong("a place of its own", format!("{path}, that of line {line}")));
            }
            taken.push((target, at));
        }
    }
    Ok(())
}

fn perform(audit: &AuditCommand) -> anyhow::Result<Finished> {
    match audit {
        AuditCommand::Map(args) => audit_map::audit(args),
        AuditCommand::Released(args) => audit_released::audit(args),
        AuditCommand::Sequence(args) => audit_sequence::audit(args),
        AuditCommand::Again(args) => audit_again::audit(args),
        AuditCommand::Images(args) => {
            let (finished, used) = audit_images::audit(args)?;
            all_could_be("used", &args.path, used.used, used.unusable)?;
            let none = || Error::new(&args.path, "", "images that can be used", "none").into();
            finished.ok_or_else(none)
        }
    }
}

/// Formats the result of an audit as one line. The path of its report is relative to the working
/// directory.
fn told(entry: &Entry, finished: &Finished, folder: &Path) -> String {
    let gates = &finished.document.gates;
    let count = |n: usize| if n == 1 { "1 gate".to_owned() } else { format!("{n} gates") };
    let broken: Vec<String> = gates
        .iter()
        .filter(|gate| !gate.passed)
        .map(|gate| format!("{} ({})", gate.gate, gate_found(gate)))
        .collect();
    let ended = match (gates.len(), broken.len()) {
        (0, _) => "audited, no gates".to_owned(),
        (n, 0) => format!("{} held", count(n)),
        (n, m) => format!("{m} of {} FAILED: {}", count(n), broken.join(", ")),
    };
    let report = folder.join(&finished.report);
    format!("{} {}: {ended}; {}", entry.kind, entry.path, report.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_is_a_configuration() {
        let text = include_str!("../../../../../docs/examples/unlift.toml");
        let entries = config::read(text, false).unwrap();
        assert_eq!(entries.iter().map(|entry| entry.kind).collect::<Vec<_>>(), ["map", "images"]);
        for entry in &entries {
            let audit = parsed(entry).unwrap();
            assert!(!result(&audit).gate.is_empty() && result(&audit).share_safe);
        }
    }

    #[test]
    fn what_the_command_line_refuses_is_one_line() {
        let told = |fields: &str| {
            let text = format!("[[map]]\npath = \"a\"\n{fields}\n");
            parsed(&config::read(&text, false).unwrap()[0]).unwrap_err()
        };
        let wrong = "invalid value '-1' for '--scale <METERS_PER_UNIT>': expected meters per unit of the map, \
                     a number above 0, found -1";
        assert_eq!(told("scale = -1"), wrong);
        let lacking = "the following required arguments were not provided: --gate <GATE>";
        assert_eq!(told("junit = \"g.xml\""), lacking);
    }
}
