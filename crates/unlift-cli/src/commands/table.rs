//! `unlift table`: prints the results of an audit as a table.

use std::io::Write;

use unlift_audit::{bail, check_file};
use unlift_io::atomic::{Access, write_file};
use unlift_io::outputs::{Kind, Rules};
use unlift_report::Document;
use unlift_report::export::{csv, latex, thresholds};

use super::common::read_document;
use crate::args::TableArgs;
use crate::output::print;
use crate::stderr;

pub fn run(args: &TableArgs) -> crate::Result<()> {
    let ending = args.out.as_ref().map(|out| {
        let ending = out.extension().unwrap_or_default();
        ending.to_string_lossy().to_ascii_lowercase()
    });
    let table: fn(&Document, &[&str]) -> String = match ending.as_deref() {
        None | Some("csv") => csv,
        Some("tex") => latex,
        Some(_) => {
            let found = args.out.iter().map(|out| out.display().to_string()).collect::<String>();
            bail!("--out: expected a name that ends in .csv or .tex, found {found}")
        }
    };
    let rules = Rules::new([args.audit.as_path()], false);
    if let Some(path) = &args.out {
        check_file("--out", path, Kind::Table, &rules)?;
    }
    let document = read_document(&args.audit)?;
    let known = thresholds(&document);
    let only = args.thresholds.as_ref().and_then(|requested| {
        let same = |typed: &&&str| typed.parse::<f64>().is_ok_and(|value| value == requested.value);
        known.iter().find(same).copied()
    });
    if let (Some(requested), None) = (&args.thresholds, only) {
        let (known, found) = (known.join(", "), &requested.label);
        bail!("--thresholds: expected one of {known}, as in the audit, found {found}");
    }
    let text = match only {
        Some(typed) => table(&document, &[typed]),
        None => table(&document, &known),
    };
    // A table does not show schemes that were not audited.
    for missing in &document.not_audited {
        let by = missing.neighbors.as_ref().map(|by| format!(" by {by}")).unwrap_or_default();
        stderr::note(format_args!("not audited: {}{by}: {}", missing.scheme, missing.reason));
    }
    match &args.out {
        // All users may read it.
        Some(path) => Ok(write_file(path, Access::Usual, |w| w.write_all(text.as_bytes()))?),
        None => print(&text),
    }
}
