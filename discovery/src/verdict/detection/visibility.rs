//! How strong an effect must be for the search to take it up.

use nalgebra::{DMatrix, DVector};

use super::free_run::FreeRuns;

/// Standard normal deviate that is exceeded once in a hundred times: a limit is what shows with 99 %.
const CERTAIN: f64 = 2.326;

/// What the search asks of an effect.
#[derive(Clone, Copy, Debug)]
pub(super) struct Asked {
    /// Fall of `-2 log L` on the training data.
    pub(super) train: f64,
    /// On held-out data, where nothing is fitted.
    pub(super) holdout: f64,
    /// Share of the squared gap on held-out data.
    pub(super) gap: f64,
}

/// The squares of what some columns do: to the innovations of both sets, whitened, and to free runs on held-out data over
/// each horizon, in multiples of what a model without fault would leave.
pub(super) struct Visibility {
    pub(super) train: DMatrix<f64>,
    pub(super) holdout: DMatrix<f64>,
    pub(super) gaps: Vec<(FreeRuns, f64)>,
}

impl Visibility {
    /// The columns in units of a scale.
    pub(super) fn scaled(&self, columns: &[usize], scale: &[f64]) -> Self {
        let of = |gram: &DMatrix<f64>| {
            DMatrix::from_fn(columns.len(), columns.len(), |a, b| scale[a] * scale[b] * gram[(columns[a], columns[b])])
        };
        let gap = |(runs, attainable): &(FreeRuns, f64)| {
            (FreeRuns { gram: of(&runs.gram), scatter: of(&runs.scatter), count: runs.count }, *attainable)
        };
        Self { train: of(&self.train), holdout: of(&self.holdout), gaps: self.gaps.iter().map(gap).collect() }
    }

    /// The length from which a vector of columns shows, in the direction in which it shows least; infinite where it never
    /// does.
    pub(super) fn needed(&self, asked: &Asked) -> f64 {
        let grams = [&self.train, &self.holdout].into_iter().chain(self.gaps.iter().map(|(runs, _)| &runs.gram));
        grams.map(|gram| self.along(&weakest(gram), asked)).fold(0.0, f64::max)
    }

    /// The same along one direction: what the most demanding of the three asks for.
    fn along(&self, direction: &DVector<f64>, asked: &Asked) -> f64 {
        let square = |gram: &DMatrix<f64>| (direction.transpose() * gram * direction)[(0, 0)].max(0.0);
        let gap = |(runs, attainable): &(FreeRuns, f64), asked: f64| {
            let all = runs.count.max(1) as f64 * attainable * attainable;
            falls_by(asked, square(&runs.gram) / all, square(&runs.scatter).sqrt() / all)
        };
        let train = (asked.train.sqrt() + CERTAIN) / square(&self.train).sqrt();
        let unfitted = square(&self.holdout);
        let holdout = falls_by(asked.holdout, unfitted, unfitted.sqrt());
        // Over one horizon it must shrink, over none grow.
        let shrinks = self.gaps.iter().map(|of| gap(of, asked.gap / (1.0 - asked.gap))).fold(f64::INFINITY, f64::min);
        let grows = self.gaps.iter().map(|of| gap(of, -2.0 * asked.gap)).fold(0.0, f64::max);
        let needed = train.max(holdout).max(shrinks).max(grows);
        if needed.is_nan() { f64::INFINITY } else { needed }
    }
}

/// The size from which a sum of squares falls by what is `asked` with certainty where nothing is fitted: at the size `a` the
/// fall is `a²` times `square`, and scatters by `2 a` times `scatter`. Where nothing falls there is no such size.
fn falls_by(asked: f64, square: f64, scatter: f64) -> f64 {
    let scatter = CERTAIN * scatter;
    let root = scatter * scatter + asked * square;
    if root < 0.0 { 0.0 } else { (scatter + root.sqrt()) / square }
}

/// The direction in which a quadratic form is smallest.
fn weakest(gram: &DMatrix<f64>) -> DVector<f64> {
    let eigen = gram.clone().symmetric_eigen();
    eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mean of so many measurements of unit noise: the standard error is known.
    #[test]
    fn a_mean_shows_from_a_multiple_of_its_standard_error() {
        let measurements = 400.0;
        let one = |square: f64| DMatrix::from_element(1, 1, square);
        let seen = Visibility { train: one(measurements), holdout: one(1e6), gaps: Vec::new() };
        let asked = Asked { train: 25.0, holdout: 5.0, gap: 0.005 };
        // No gap is asked about, so none shows.
        assert_eq!(seen.needed(&asked), f64::INFINITY);
        let runs = FreeRuns { gram: one(1e9), scatter: one(1e9), count: 10_000 };
        let seen = Visibility { gaps: vec![(runs, 1.0)], ..seen };
        let standard_error = 1.0 / measurements.sqrt();
        assert!((seen.needed(&asked) - (5.0 + CERTAIN) * standard_error).abs() < 1e-12);
    }

    #[test]
    fn a_vector_shows_where_it_shows_least() {
        let gram = DMatrix::from_diagonal(&DVector::from_vec(vec![100.0, 4.0]));
        let large = DMatrix::from_diagonal(&DVector::from_vec(vec![1e8, 1e8]));
        let runs = FreeRuns { gram: large.clone(), scatter: large.clone(), count: 1000 };
        let seen = Visibility { train: gram, holdout: large, gaps: vec![(runs, 1.0)] };
        let asked = Asked { train: 25.0, holdout: 5.0, gap: 0.005 };
        assert!((seen.needed(&asked) - (5.0 + CERTAIN) / 2.0).abs() < 1e-9);
        // In units twice as large the numbers are half as large.
        assert!((seen.scaled(&[1], &[2.0]).needed(&asked) - (5.0 + CERTAIN) / 4.0).abs() < 1e-9);
    }

    /// The fall of `-2 log L` by an effect of the size that is asked for, over draws of the noise.
    #[test]
    fn held_out_data_show_it_in_99_of_100_draws() {
        let size = falls_by(5.0, 1.0, 1.0);
        let draws = 20_000;
        assert_eq!(falls_by(-0.01, 4.0, 0.01), 0.0, "it never grows by so much");
        let fell = crate::data::recording::noise(draws, 3).filter(|e| size * size + 2.0 * size * e > 5.0).count();
        assert!((0.985..0.995).contains(&(fell as f64 / draws as f64)), "{fell}");
    }
}
