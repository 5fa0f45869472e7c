//! Reads positions from point clouds of scanners.

pub mod e57;
pub mod las;
mod lzf;
pub mod pcd;

/// Returns true if a coordinate system in well-known text is in degrees of longitude and latitude.
fn is_geographic(wkt: &str) -> bool {
    let wkt: String = wkt.chars().filter(|c| !c.is_whitespace()).collect::<String>().to_uppercase();
    // A projected system contains the geographic one that it is based on. A geocentric system is in
    // meters.
    let lengths = ["PROJCS[", "PROJCRS[", "PROJECTEDCRS[", "GEOCCS[", "LOCAL_CS[", "CS[CARTESIAN"];
    let degrees = ["GEOGCS[", "GEOGCRS[", "GEOGRAPHICCRS[", "GEODCRS[", "GEODETICCRS["];
    !lengths.iter().any(|word| wkt.contains(word)) && degrees.iter().any(|word| wkt.contains(word))
}

#[cfg(test)]
mod tests {
    use super::is_geographic;

    #[test]
    fn degrees_are_told_from_lengths() {
        let wgs84 = "GEOGCS[\"WGS 84\", DATUM[\"WGS_1984\"], UNIT[\"degree\", 0.0174]]";
        assert!(is_geographic(wgs84));
        assert!(is_geographic(&format!("COMPD_CS[\"both\", {wgs84}, VERT_CS[\"height\"]]")));
        assert!(is_geographic("GEOGCRS[\"WGS 84\", CS[ellipsoidal, 2]]"));
        assert!(!is_geographic(&format!("PROJCS[\"UTM\", {wgs84}, UNIT[\"metre\", 1]]")));
        assert!(!is_geographic("PROJCRS[\"UTM\", BASEGEOGCRS[\"WGS 84\"], CS [Cartesian, 2]]"));
        assert!(!is_geographic("GEODCRS[\"WGS 84\", CS[Cartesian, 3]]"));
        assert!(!is_geographic(""));
    }
}
