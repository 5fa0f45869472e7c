//! `unlift schemes`: what can be audited.

use crate::exit::Outcome;
use crate::output::print;
use crate::values::all_schemes;

/// Lists every scheme with what is known about it.
pub fn run() -> anyhow::Result<Outcome> {
    let mut text = String::new();
    for scheme in all_schemes() {
        text.push_str(&format!(
            "{}\n  rule     {}\n  hidden   {}\n  source   {}\n  patents  {}\n",
            scheme.name, scheme.summary, scheme.hidden, scheme.source, scheme.patents
        ));
    }
    print(&text)?;
    Ok(Outcome::Done)
}
