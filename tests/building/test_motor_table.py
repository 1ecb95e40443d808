"""Tables of motors and gearboxes as MGDB lays them out: figures by hand, what is missing, commands."""

import pytest
from typer.testing import CliRunner

from armdesign.building.catalogue import examine, find_catalogue
from armdesign.cli import app
from armdesign.errors import CatalogueError

COLUMNS = "key,manufacturer,ID,type,V,k_t,R,L,mass,inertia,omega_nl,I_nl,I_nom,max_int_torque,max_int_speed"
MOTORS = f"""{COLUMNS},max_cont_speed,diameter,length
CU_A,Custom,A,BLDC,24,0.05,0.5,0.001,0.2,1e-5,480,0.1,4,1.0,inf,inf,0.05,0.03
CU_B,Custom,B,BLDC,24,0.05,0.5,0.001,0.2,1e-5,480,0.1,4,inf,400,nan,0.05,0.03
"""
GEARED = "key,manufacturer,ID,type,stages,ratio,mass,inertia,efficiency,direction,max_int_torque,max_cont_torque"
GEARBOXES = f"""{GEARED},diameter,length
CU_G_R10,Custom,G,planetary,1,10,0.1,2e-6,0.8,1,6,inf,0.06,0.02
CU_G_R50,Custom,G,planetary,2,50,0.15,2e-6,0.7,1,inf,5,0.04,0.04
"""


@pytest.fixture
def table(tmp_path):
    (tmp_path / "my_motors.csv").write_text(MOTORS)
    (tmp_path / "my_gearboxes.csv").write_text(GEARBOXES)
    (tmp_path / "my_compatibility.csv").write_text("CU_A,CU_G_R*\nCU_B,CU_G_R10\n")
    return tmp_path / "my_motors.csv"


def test_figures_by_hand(table):
    found = find_catalogue(str(table))
    assert (found.family, found.maker) == ("my", "Custom")
    fast, slow, other = found.actuators
    assert [a.name for a in found.actuators] == ["CU_A + CU_G_R10", "CU_A + CU_G_R50", "CU_B + CU_G_R10"]
    # k_t I_nom = 0.2 N m, stall at k_t V / R = 2.4 N m, for a time 1 N m
    assert (fast.rated_torque, fast.peak_torque) == pytest.approx((1.6, 6.0))  # the gearbox bears 6, not 8
    assert (slow.rated_torque, slow.peak_torque) == pytest.approx((5.0, 35.0))  # the gearbox bears 5, not 7
    assert (fast.no_load_speed, fast.rated_speed) == pytest.approx((48.0, 48.0 * (1 - 0.2 / 2.4)))
    assert slow.rated_speed == pytest.approx(9.6 * (1 - 5.0 / 35.0 / 2.4))
    assert (fast.mass, fast.diameter, fast.length) == pytest.approx((0.3, 0.06, 0.05))
    assert fast.reflected_inertia == pytest.approx(1.2e-5 * 100)
    assert (other.peak_torque, other.no_load_speed, other.ratio) == pytest.approx((6.0, 40.0, 10.0))
    assert other.rated_speed == pytest.approx(40.0)  # the speed that it bears for a time is the lower one
    assert "MGDB" in found.source("mass").document


def test_what_is_missing_is_said(table, tmp_path):
    bare = tmp_path / "bare_motors.csv"
    bare.write_text("\n".join(line.rsplit(",", 2)[0] for line in MOTORS.splitlines()))
    found, faults = examine(bare)
    assert found is None
    assert "'diameter' and 'length'" in faults[0]
    bare.write_text(MOTORS.replace("k_t", "kt"))
    with pytest.raises(CatalogueError) as error:
        examine(bare)
    assert error.value.value == ["k_t"]
    bare.write_text(MOTORS.replace("0.2,1e-5", "light,1e-5", 1))
    with pytest.raises(CatalogueError) as error:
        examine(bare)
    assert error.value.value == "light"
    outcome = CliRunner().invoke(app, ["catalogue", "check", str(bare)])
    assert (outcome.exit_code, "'mass'" in outcome.stderr) == (2, True)
