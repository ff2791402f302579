"""What can be seen and told apart: small systems by hand."""

import numpy as np

from fdi.diagnosis.isolability import implementable_isolability, structural_isolability

from .build import bank_of, model


def test_three_sensors_of_one_quantity_are_all_told_apart():
    bank = bank_of(model({"gps": ["x"], "baro": ["x"], "radar": ["x"]}))
    for found in (implementable_isolability(bank), structural_isolability(bank.system)):
        assert found.faults == ("GPS.x", "BARO.x", "RADAR.x")
        assert found.detectable.all()
        assert np.array_equal(found.matrix, ~np.eye(3, dtype=bool))
        assert found.groups == ()


def test_two_sensors_of_one_quantity_are_one_group_and_a_lone_one_is_not_seen():
    bank = bank_of(model({"gps": ["x"], "baro": ["x"], "compass": ["y"]}))
    for found in (implementable_isolability(bank), structural_isolability(bank.system)):
        assert found.detectable.tolist() == [True, True, False]
        assert found.groups == (("GPS.x", "BARO.x"),)
        assert "<td>1</td><td>GPS.x, BARO.x</td>" in found._repr_html_()
        assert found.matrix[0].tolist() == [False, False, True]
        assert not found.matrix[2].any()


def test_limit_makes_each_sensor_testable_alone():
    bank = bank_of(
        model({"gps": ["x"], "baro": ["x"]}, more="limits:\n  high: {variable: x, max: 9}\n"),
        "mtes",
    )
    found = implementable_isolability(bank)
    assert {g.faults for g in bank.generators} == {("GPS.x",), ("BARO.x",)}
    assert found.matrix.tolist() == [[False, True], [True, False]]


def test_what_only_structure_promises_is_not_in_the_implementable_matrix():
    """Nothing can be solved for x, so its test set has no generator; structure still sees it."""
    text = model({"gps": ["x"], "baro": ["y"]}).replace(
        "measurements:",
        "  z: {unit: m}\nequations:\n"
        '  a: {text: "z = x", solves: []}\n  b: {text: "z = y", solves: []}\nmeasurements:',
    )
    bank = bank_of(text, "mtes")
    seen = implementable_isolability(bank).detectable
    assert structural_isolability(bank.system).detectable.all()
    assert not seen.any()
    assert len(bank.not_implementable) == 1


def test_frame_is_the_matrix_with_names():
    frame = implementable_isolability(bank_of(model({"gps": ["x"], "baro": ["x"]}))).frame()
    assert frame.index.tolist() == frame.columns.tolist() == ["GPS.x", "BARO.x"]
    assert frame.to_numpy().tolist() == [[0, 0], [0, 0]]


def test_a_channel_is_at_fault_wherever_it_is_read_as_an_input_too():
    """What the receiver tells of x gives u as well, which the compass shows by itself."""
    text = model({"gps": ["x"], "baro": ["x"], "compass": ["w"]}).replace(
        "measurements:",
        "  u: {unit: m}\nequations:\n  a: {text: w = u, solves: [w]}\n"
        "inputs:\n  GPS: {component: gps, fields: {x: {variable: u, accuracy: 1 m}}}\n"
        "measurements:",
    )
    found = structural_isolability(bank_of(text).system)
    assert found.faults == ("GPS.x", "BARO.x", "COMPASS.w")
    assert found.matrix.tolist() == [
        [False, True, True],  # without the barometer the compass still tells of it
        [False, False, True],
        [False, True, False],
    ]
