//! `unlift split`: splits a stage file into a folder of parts.

use unlift::OneLine;
use unlift_audit::refused;
use unlift_io::atomic::Rules;
use unlift_io::stage::Split;

use crate::args::SplitArgs;
use crate::exit::Outcome;
use crate::output::print;

pub fn run(args: &SplitArgs) -> anyhow::Result<Outcome> {
    let split = Split::open(&args.path, args.rows)?;
    let rules = Rules::new([args.path.as_path()], args.force);
    let outputs = split.outputs(&args.out, rules).map_err(refused)?;
    let (kind, rows, parts) = (split.kind(), split.n_rows(), split.n_parts());
    split.write(outputs)?;
    let parts = format!("{parts} part{}", if parts == 1 { "" } else { "s" });
    print(&format!("{kind}: {rows} rows in {parts}, in {}\n", OneLine(args.out.display())))?;
    Ok(Outcome::Done)
}
