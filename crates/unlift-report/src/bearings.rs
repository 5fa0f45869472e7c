//! What schemes that publish bearings show.

use crate::document::Document;
use crate::words;

/// Returns what a scheme that publishes bearings shows; `None` for others. Recovered points say nothing about it: all bearings
/// meet in the center, so no attack finds ranges, but directions are released as they are.
pub(crate) fn said(document: &Document, scheme: &str) -> Option<String> {
    let rows = document.results.iter().filter(|row| row.scheme == scheme);
    let of = |name: &str| {
        let values = rows.clone().filter_map(|row| row.metrics.get(name).copied());
        values.max_by(f64::total_cmp)
    };
    let real = words::percent(of("real_bearings_percent")?);
    let name = scheme.to_uppercase();
    let said = format!(
        "{name} publishes bearings: whoever stands in the center sees the scene. {real} % of the bearings are real"
    );
    Some(match of("decoys_area") {
        Some(area) => {
            let order = words::percent(100.0 * area);
            format!(
                "{said}; by descriptors, an attacker tells a decoy from a real bearing in {order} % of pairs (50 % would be chance)."
            )
        }
        None => format!("{said}."),
    })
}
