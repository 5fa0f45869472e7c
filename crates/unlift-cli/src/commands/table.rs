//! `unlift table`: prints the results of an audit as a table.

use std::io::Write;
use std::path::Path;

use unlift_audit::{bail, check_file};
use unlift_io::atomic::{Access, write_file};
use unlift_io::outputs::{Kind, Rules};
use unlift_report::Document;
use unlift_report::export::{csv, latex, thresholds};

use super::common::read_document;
use crate::args::TableArgs;
use crate::output::{note, print};

pub fn run(args: &TableArgs) -> crate::Result<()> {
    let ends_in = |out: &Path, ending: &str| {
        out.extension().is_some_and(|of| of.eq_ignore_ascii_case(ending))
    };
    let table: fn(&Document, &[&str]) -> String = match &args.out {
        Some(out) if ends_in(out, "tex") => latex,
        Some(out) if !ends_in(out, "csv") => {
            bail!("--out: expected a name that ends in .csv or .tex, found {}", out.display())
        }
        _ => csv,
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
    let text = table(&document, if only.is_some() { only.as_slice() } else { &known });
    // A table does not show schemes that were not audited.
    for missing in &document.not_audited {
        let by = missing.neighbors.as_ref().map(|by| format!(" by {by}")).unwrap_or_default();
        note(format_args!("not audited: {}{by}: {}", missing.scheme, missing.reason));
    }
    match &args.out {
        // All users may read it.
        Some(path) => Ok(write_file(path, Access::Usual, |w| w.write_all(text.as_bytes()))?),
        None => print(&text),
    }
}
