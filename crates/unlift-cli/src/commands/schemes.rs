//! `unlift schemes`: what can be audited.

use unlift::obfuscate::SCHEMES;

use crate::exit::Outcome;
use crate::output::print;

/// Lists every scheme with what is known about it.
pub fn run() -> anyhow::Result<Outcome> {
    let mut text = String::new();
    for scheme in SCHEMES {
        let meant_for = match (scheme.in_3d, scheme.in_2d) {
            (Some(_), Some(_)) => "maps and images",
            (Some(_), None) => "maps",
            (None, _) => "images",
        };
        let facts = scheme.facts;
        text.push_str(&format!(
            "{}\n  for      {meant_for}\n  rule     {}\n  hidden   {}\n  source   {}\n  patents  {}\n",
            scheme.name, facts.summary, facts.hidden, facts.source, facts.patents
        ));
    }
    print(&text)?;
    Ok(Outcome::Done)
}
