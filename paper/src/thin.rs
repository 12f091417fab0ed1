//! Lines with no more points than can be seen.

/// The line with what cannot be seen left out: of each column of pixels first, lowest, highest and last point are kept, and of
/// these what the straight line between its neighbours misses by more than a twentieth of a pixel. `pixel` is the size of one
/// in the line's units.
pub(crate) fn thin(points: &[(f64, f64)], pixel: (f64, f64)) -> Vec<(f64, f64)> {
    let mut kept = Vec::new();
    let mut rest = points;
    while let Some(first) = rest.first() {
        let column = (first.0 / pixel.0).floor();
        let count = rest.iter().take_while(|p| (p.0 / pixel.0).floor() == column).count().max(1);
        let (here, later) = rest.split_at(count);
        let by_value = |a: &usize, b: &usize| here[*a].1.total_cmp(&here[*b].1);
        let (low, high) = ((0..count).min_by(by_value).unwrap_or(0), (0..count).max_by(by_value).unwrap_or(0));
        let mut places = [0, low, high, count - 1];
        places.sort_unstable();
        let mut before = None;
        for place in places {
            if before != Some(place) {
                kept.push(here[place]);
            }
            before = Some(place);
        }
        rest = later;
    }
    let ends = [0, kept.len().saturating_sub(1)];
    let mut keep: Vec<bool> = (0..kept.len()).map(|k| ends.contains(&k)).collect();
    // Douglas and Peucker.
    let mut stretches = vec![(ends[0], ends[1])];
    while let Some((a, b)) = stretches.pop() {
        let miss = |k: usize| {
            let at = |k: usize| (kept[k].0 / pixel.0, kept[k].1 / pixel.1);
            let (from, to, p) = (at(a), at(b), at(k));
            let (along, aside) = ((to.0 - from.0, to.1 - from.1), (p.0 - from.0, p.1 - from.1));
            let length = along.0.hypot(along.1).max(1e-12);
            (along.0 * aside.1 - along.1 * aside.0).abs() / length
        };
        let worst = (a + 1..b).map(|k| (k, miss(k))).max_by(|x, y| x.1.total_cmp(&y.1));
        if let Some((k, _)) = worst.filter(|(_, miss)| *miss > 0.05) {
            keep[k] = true;
            stretches.extend([(a, k), (k, b)]);
        }
    }
    kept.iter().zip(&keep).filter(|(_, keep)| **keep).map(|(p, _)| *p).collect()
}

#[cfg(test)]
mod tests {
    use super::thin;

    #[test]
    fn straight_lines_keep_their_ends() {
        let line: Vec<(f64, f64)> = (0..1000).map(|k| (f64::from(k), 3.0 * f64::from(k))).collect();
        assert_eq!(thin(&line, (2.0, 6.0)), [(0.0, 0.0), (999.0, 2997.0)]);
        assert_eq!(thin(&[], (1.0, 1.0)), []);
        assert_eq!(thin(&[(0.0, 1.0)], (1.0, 1.0)), [(0.0, 1.0)]);
    }

    #[test]
    fn an_oscillation_within_a_column_keeps_its_height() {
        let line: Vec<(f64, f64)> = (0..100_000).map(|k| (f64::from(k) * 1e-3, (f64::from(k) * 0.7).sin())).collect();
        let thinned = thin(&line, (0.5, 0.01));
        assert!(thinned.len() < 1000, "{}", thinned.len());
        let high = thinned.iter().filter(|p| p.1 > 0.99).count();
        let low = thinned.iter().filter(|p| p.1 < -0.99).count();
        assert!(high >= 190 && low >= 190, "{high} {low}: an extreme in each of 200 columns");
    }

    #[test]
    fn a_curve_is_met_within_a_fraction_of_a_pixel() {
        let line: Vec<(f64, f64)> = (0..2000).map(|k| (f64::from(k) * 0.01, (f64::from(k) * 0.01).sin())).collect();
        let pixel = (0.05, 0.02);
        let thinned = thin(&line, pixel);
        assert!(thinned.len() < 200, "{}", thinned.len());
        for (t, v) in &line {
            let i = thinned.partition_point(|p| p.0 <= *t).clamp(1, thinned.len() - 1);
            let (a, b) = (thinned[i - 1], thinned[i]);
            let between = a.1 + (b.1 - a.1) * (t - a.0) / (b.0 - a.0);
            assert!((between - v).abs() < 0.5 * pixel.1, "{t}: {between} {v}");
        }
    }
}
