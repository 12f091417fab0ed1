//! Places that belong together, said as one.

use super::data::Located;

/// Places of which there is one for each cable; all of them are the place without a number.
const OF_CABLES: [&str; 7] =
    ["winch", "cable", "anchor", "attachment", "sensor.cable_length", "sensor.unstretched_length", "sensor.tension"];

/// Families of places that make up a whole, with the name of the whole.
fn wholes(cables: usize) -> Vec<(&'static str, Vec<String>)> {
    let platform = ["force_x", "force_y", "torque"].map(|axis| format!("platform.{axis}"));
    let mut wholes = vec![("platform", platform.to_vec()), ("platform", platform[..2].to_vec())];
    wholes.extend(OF_CABLES.map(|name| (name, (1..=cables).map(|i| format!("{name}[{i}]")).collect())));
    wholes
}

/// Shares nearer than this are one effect's, divided evenly.
const SAME: f64 = 1e-6;

/// The places in order of their share, with those that share one effect evenly put together: all winches of a robot with so
/// many cables become `winch`, the two forces on the platform `platform`.
#[must_use]
pub fn gather(located: &[Located], cables: usize) -> Vec<Located> {
    let mut left: Vec<Located> = located.to_vec();
    let mut whole = Vec::new();
    for (name, parts) in wholes(cables) {
        let found: Vec<usize> = parts.iter().filter_map(|part| left.iter().position(|l| l.place == *part)).collect();
        let same = |at: &usize| {
            let (a, b) = (&left[found[0]], &left[*at]);
            (a.share_of_gap - b.share_of_gap).abs() < SAME && a.depends_on == b.depends_on
        };
        if found.len() == parts.len() && found.iter().all(same) {
            let one = left[found[0]].clone();
            let share_of_gap = one.share_of_gap * parts.len() as f64;
            left.retain(|l| !parts.contains(&l.place));
            whole.push(Located { place: name.to_owned(), share_of_gap, ..one });
        }
    }
    whole.extend(left);
    whole.sort_by(|a, b| b.share_of_gap.total_cmp(&a.share_of_gap));
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    fn located(place: &str, share_of_gap: f64, on: &str) -> Located {
        Located { place: place.to_owned(), share_of_gap, when: vec![], depends_on: vec![on.to_owned()] }
    }

    fn shares(list: &[Located], cables: usize) -> Vec<(String, f64)> {
        gather(list, cables).into_iter().map(|l| (l.place, l.share_of_gap)).collect()
    }

    #[test]
    fn even_shares_of_one_effect_become_one_place() {
        let mut list: Vec<Located> = (1..=4).map(|i| located(&format!("winch[{i}]"), 0.1, "speed")).collect();
        list.push(located("platform.force_x", 0.3, "speed"));
        list.push(located("platform.force_y", 0.3, "speed"));
        assert_eq!(shares(&list, 4), [("platform".to_owned(), 0.6), ("winch".to_owned(), 0.4)]);
        // Of a robot with more cables, these are some of the winches.
        assert_eq!(shares(&list, 6).len(), 5);
    }

    #[test]
    fn what_differs_stays_apart() {
        let list = [
            located("winch[1]", 0.2, "speed"),
            located("winch[2]", 0.3, "speed"),
            located("platform.force_x", 0.25, "speed"),
            located("platform.force_y", 0.25, "time"),
        ];
        let found = shares(&list, 4);
        assert_eq!(found.len(), 4);
        assert_eq!(found[0], ("winch[2]".to_owned(), 0.3));
    }
}
