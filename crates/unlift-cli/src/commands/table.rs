//! `unlift table`: prints the results of an audit as a table or curves.

use std::io::Write;
use std::path::Path;

use unlift_audit::check_file_of;
use unlift_io::atomic::{Access, Kind, Rules, write_file};
use unlift_report::export::{curves, table, thresholds};

use super::common::read_document;
use crate::args::TableArgs;
use crate::exit::{Outcome, usage};
use crate::output::print;
use crate::stderr;

pub fn run(args: &TableArgs) -> anyhow::Result<Outcome> {
    let rules = Rules::new([args.audit.as_path()], args.force);
    let mut taken = Vec::new();
    for (option, path, kind) in
        [("--out", &args.out, Kind::Table), ("--curves", &args.curves, Kind::Curves)]
    {
        let Some(path) = path else { continue };
        let target = check_file_of(option, path, kind, &rules)?;
        if taken.contains(&target) {
            let path = path.display();
            return Err(usage(format!(
                "{option}: {path}: expected a file of its own, found that of --out"
            )));
        }
        taken.push(target);
    }
    let document = read_document(&args.audit)?;
    let known = thresholds(&document);
    let only = args.threshold.as_ref().map(|asked| {
        let same = |typed: &&String| typed.parse::<f64>().is_ok_and(|value| value == asked.value);
        known.iter().find(same).map(String::as_str).ok_or_else(|| {
            let (known, found) = (known.join(", "), &asked.label);
            usage(format!("--threshold: expected one of {known}, as in the audit, found {found}"))
        })
    });
    let only = only.transpose()?;
    let drawing = match &args.curves {
        Some(_) => Some(curves(&document, only).ok_or_else(|| {
            usage("--curves: expected an audit with rows by the oracle, found none")
        })?),
        None => None,
    };
    let text = table(&document, args.format, only);
    // A table does not show schemes that were not audited.
    for refused in &document.not_audited {
        let by = refused.neighbors.as_ref().map(|by| format!(" by {by}")).unwrap_or_default();
        stderr::note(format_args!("not audited: {}{by}: {}", refused.scheme, refused.reason));
    }
    if let (Some(path), Some(drawing)) = (&args.curves, &drawing) {
        write(path, drawing)?;
    }
    match &args.out {
        Some(path) => write(path, &text)?,
        None => print(&text)?,
    }
    Ok(Outcome::Done)
}

/// Writes a file that all users may read.
fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    Ok(write_file(path, Access::Usual, |w| w.write_all(text.as_bytes()))?)
}
