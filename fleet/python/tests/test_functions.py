"""Tests that the functions in datafusion-python give the same results as NumPy."""

import json

import datafusion
import numpy as np
import pyarrow as pa
import pytest
import stretch_datafusion

RATE = {
    b"stretch.sample_rate_hz": b"100",
    b"stretch.rate_estimator": json.dumps({"savitzky_golay": {"window": 11, "degree": 2, "delay": 0}}).encode(),
}


def rows(sensor, count=4000):
    """Return rate, signal and reference of a simulated gauge with noise."""
    noise = np.random.default_rng(sensor)
    phase = 0.01 * np.arange(count) + sensor
    signal = 1.5 + 0.4 * np.sin(phase) + 1e-3 * noise.standard_normal(count)
    rate = 0.4 * np.cos(phase) * (1 + 0.4 * np.sin(0.137 * phase)) + 1e-2 * noise.standard_normal(count)
    reference = 0.1 * signal - 0.02 * signal**2 + 0.003 * rate * signal + 1e-3 * noise.standard_normal(count)
    return rate, signal, reference


def by_numpy(rate, signal, reference):
    """Return the coefficients of both branches in the order of `poly13_fit`: p00 p10 p01 p11 p02 p12 p03."""
    answer = []
    for side in (rate >= 0, rate < 0):
        r, v = rate[side], signal[side]
        design = np.stack([np.ones_like(r), r, v, r * v, v**2, r * v**2, v**3], 1)
        answer.extend(np.linalg.lstsq(design, reference[side], rcond=None)[0])
    return np.array(answer)


@pytest.fixture
def session():
    context = datafusion.SessionContext()
    stretch_datafusion.register(context)
    tables = []
    for sensor in (1, 2, 3):
        columns = [pa.array(values) for values in rows(sensor)]
        schema = pa.schema([
            pa.field("sensor", pa.int64()),
            pa.field("rate", pa.float64(), metadata=RATE),
            pa.field("bridge_v", pa.float64()),
            pa.field("contraction", pa.float64()),
        ])
        batch = pa.record_batch([pa.array([sensor] * len(columns[0])), *columns], schema=schema)
        tables.append([batch])
    context.register_record_batches("trials", tables)
    return context


def test_fits_are_those_of_numpy(session):
    answer = session.sql(
        "select sensor, poly13_fit(rate, bridge_v, contraction) as fit from trials group by sensor order by sensor"
    ).to_pylist()
    assert [row["sensor"] for row in answer] == [1, 2, 3]
    for row in answer:
        expected = by_numpy(*rows(row["sensor"]))
        np.testing.assert_allclose(row["fit"]["coefficients"], expected, rtol=1e-8, atol=1e-10)
        assert row["fit"]["rows"] == 4000 and row["fit"]["refused"] is None


def test_a_line(session):
    _, signal, reference = rows(2)
    one = session.sql(
        "select linear_fit(bridge_v, contraction) as line from trials where sensor = 2"
    ).to_pylist()[0]
    expected = np.polynomial.polynomial.polyfit(signal, reference, 1)
    np.testing.assert_allclose(one["line"]["coefficients"], expected, rtol=1e-10)


def test_states_merge_to_the_fit_of_all(session):
    merged = session.sql(
        "select poly13_merge(state)['coefficients'] as c from "
        "(select sensor, poly13_state(rate, bridge_v, contraction) as state from trials group by sensor)"
    ).to_pylist()[0]["c"]
    all_rows = [np.concatenate(column) for column in zip(*(rows(sensor) for sensor in (1, 2, 3)), strict=True)]
    np.testing.assert_allclose(merged, by_numpy(*all_rows), rtol=1e-8, atol=1e-10)


def test_a_record_crosses_and_estimates(session):
    """The metadata of the columns reaches the fit, so the result has a calibration. The calibration estimates rows."""
    record = session.sql(
        "select poly13_fit(rate, bridge_v, contraction)['record'] as record from trials where sensor = 1"
    ).to_pylist()[0]["record"]
    assert json.loads(record)
    session.register_record_batches("records", [[pa.record_batch({"record": [record]})]])
    rmse = session.sql(
        "select sqrt(avg(power(contraction - strain_estimate(record, rate, bridge_v), 2))) as rmse "
        "from trials cross join records where sensor = 1"
    ).to_pylist()[0]["rmse"]
    assert 0.9e-3 < rmse < 1.1e-3


def test_a_sensor_that_cannot_be_fitted_says_why(session):
    refused = session.sql(
        "select poly13_fit(rate, bridge_v, contraction)['refused'] as why from trials where rate > 0"
    ).to_pylist()[0]["why"]
    assert "the signal never falls" in refused


def test_what_cannot_be_asked_is_an_error(session):
    with pytest.raises(Exception, match="poly13_fit"):
        session.sql("select poly13_fit(rate, bridge_v) from trials").collect()
    assert {f.name for f in stretch_datafusion.aggregates()} >= {"poly13_fit", "linear_fit"}
