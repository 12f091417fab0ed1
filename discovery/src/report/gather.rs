//! Places that belong together, said as one.

use super::data::Located;

/// Families of places that make up a whole, with the name of the whole.
const WHOLES: [(&str, &[&str]); 8] = [
    ("platform", &["platform.force_x", "platform.force_y", "platform.torque"]),
    ("platform", &["platform.force_x", "platform.force_y"]),
    ("winch", &["winch[1]", "winch[2]", "winch[3]", "winch[4]"]),
    ("cable", &["cable[1]", "cable[2]", "cable[3]", "cable[4]"]),
    ("anchor", &["anchor[1]", "anchor[2]", "anchor[3]", "anchor[4]"]),
    ("attachment", &["attachment[1]", "attachment[2]", "attachment[3]", "attachment[4]"]),
    (
        "sensor.cable_length",
        &["sensor.cable_length[1]", "sensor.cable_length[2]", "sensor.cable_length[3]", "sensor.cable_length[4]"],
    ),
    (
        "sensor.unstretched_length",
        &[
            "sensor.unstretched_length[1]",
            "sensor.unstretched_length[2]",
            "sensor.unstretched_length[3]",
            "sensor.unstretched_length[4]",
        ],
    ),
];
/// Shares nearer than this are one effect's, divided evenly.
const SAME: f64 = 1e-6;

/// The places in order of their share, with those that share one effect evenly put together: four winches become
/// `winch`, the two forces on the platform `platform`.
#[must_use]
pub fn gather(located: &[Located]) -> Vec<Located> {
    let mut left: Vec<Located> = located.to_vec();
    let mut whole = Vec::new();
    for (name, parts) in WHOLES {
        let found: Vec<usize> = parts.iter().filter_map(|part| left.iter().position(|l| l.place == *part)).collect();
        let same = |at: &usize| {
            let (a, b) = (&left[found[0]], &left[*at]);
            (a.share_of_gap - b.share_of_gap).abs() < SAME && a.depends_on == b.depends_on
        };
        if found.len() == parts.len() && found.iter().all(same) {
            let one = left[found[0]].clone();
            let share_of_gap = one.share_of_gap * parts.len() as f64;
            left.retain(|l| !parts.contains(&l.place.as_str()));
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

    fn shares(list: &[Located]) -> Vec<(String, f64)> {
        gather(list).into_iter().map(|l| (l.place, l.share_of_gap)).collect()
    }

    #[test]
    fn even_shares_of_one_effect_become_one_place() {
        let mut list: Vec<Located> = (1..=4).map(|i| located(&format!("winch[{i}]"), 0.1, "speed")).collect();
        list.push(located("platform.force_x", 0.3, "speed"));
        list.push(located("platform.force_y", 0.3, "speed"));
        assert_eq!(shares(&list), [("platform".to_owned(), 0.6), ("winch".to_owned(), 0.4)]);
    }

    #[test]
    fn what_differs_stays_apart() {
        let list = [
            located("winch[1]", 0.2, "speed"),
            located("winch[2]", 0.3, "speed"),
            located("platform.force_x", 0.25, "speed"),
            located("platform.force_y", 0.25, "time"),
        ];
        let found = shares(&list);
        assert_eq!(found.len(), 4);
        assert_eq!(found[0], ("winch[2]".to_owned(), 0.3));
    }
}
