//! The information criterion: what a model costs beside its `-2 log L`, and how much it must fall to be believed.

/// Fall of the information criterion below which nothing is believed, beyond the penalty of the parameters.
pub(crate) const EVIDENCE: f64 = 10.0;
/// Difference of the criterion up to which two explanations are not told apart.
const INDISTINGUISHABLE: f64 = 10.0;
/// The same as a share of what the effect explains: no law is known to be exact beyond this.
const INDISTINGUISHABLE_SHARE: f64 = 0.01;

/// Difference of the criterion up to which an effect that explains `delta_bic` and another one are not told apart.
pub(crate) fn told_apart_from(delta_bic: f64) -> f64 {
    INDISTINGUISHABLE.max(INDISTINGUISHABLE_SHARE * delta_bic.abs())
}

/// What parameters cost: the extended BIC (J. Chen and Z. Chen, Biometrika 95 (2008)), `ln n` for each parameter and
/// `2 ln p` for each choice among `p` candidates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Penalty {
    parameter: f64,
    choice: f64,
}

impl Penalty {
    /// No cost.
    pub(crate) const NONE: Self = Self { parameter: 0.0, choice: 0.0 };

    /// For `count` measurements and a catalogue of some 200 candidates.
    pub(crate) fn new(count: usize) -> Self {
        Self { parameter: (count.max(2) as f64).ln(), choice: 2.0 * 200.0_f64.ln() }
    }

    /// Of so many parameters of something that is not chosen among many.
    pub(crate) fn of_parameters(self, parameters: usize) -> f64 {
        self.parameter * parameters as f64
    }

    /// Of so many times at which effects begin or end: each is a parameter, and a choice among many.
    pub(crate) fn of_times(self, times: usize) -> f64 {
        self.of(1) * times as f64
    }

    /// Of one effect with so many parameters.
    pub(crate) fn of(self, parameters: usize) -> f64 {
        self.choice + self.parameter * parameters as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `n` measurements, `k` parameters and a choice among 200: `k ln n + 2 ln 200`.
    #[test]
    fn the_penalty_is_that_of_the_extended_criterion() {
        let penalty = Penalty::new(5000);
        let wanted = 3.0 * 5000.0_f64.ln() + 2.0 * 200.0_f64.ln();
        assert!((penalty.of(3) - wanted).abs() < 1e-12);
        assert!((penalty.of(3) - penalty.of_parameters(3) - 2.0 * 200.0_f64.ln()).abs() < 1e-12);
        assert_eq!(penalty.of_times(2), 2.0 * penalty.of(1));
        assert_eq!(Penalty::NONE.of(7), 0.0);
    }

    #[test]
    fn no_law_is_told_from_another_beyond_a_hundredth_of_what_it_explains() {
        assert_eq!(told_apart_from(-900.0), 10.0);
        assert_eq!(told_apart_from(-9000.0), 90.0);
    }
}
