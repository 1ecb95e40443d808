"""Shoulder, elbow, wrist and hand by their names."""

import numpy as np
import pytest

from armdesign.demonstration.points.expressions import parse
from armdesign.demonstration.points.guess import find_arms, guess_arm

SCHEMES = {
    "Plug-in Gait": (
        "LFHD RSHO LSHO RELB RWRA RWRB RFIN LELB LWRA LWRB LFIN RASI",
        "shoulder=RSHO elbow=RELB wrist=RWRA+RWRB hand=RFIN",
    ),
    "Plug-in Gait, one wrist": ("RSHO RELB RWRI", "shoulder=RSHO elbow=RELB wrist=RWRI"),
    "Plug-in Gait, by subject": (
        "S:RSHO S:RELB S:RWRA S:RWRB S:RFIN box:1",
        "shoulder=S:RSHO elbow=S:RELB wrist=S:RWRA+S:RWRB hand=S:RFIN",
    ),
    "joint centres": ("RSHO RELB RWRA RSJC REJC RWJC", "shoulder=RSJC elbow=REJC wrist=RWJC"),
    "Vicon names": (
        "ACRO_tip EPICl EPICm STYLr STYLr_up STYLu WRIST INDEX LASTC MEDH LATH",
        "shoulder=ACRO_tip elbow=EPICl+EPICm wrist=STYLr+STYLu hand=INDEX+LASTC+MEDH+LATH",
    ),
    "ISB": ("AC EL EM RS US MCP2 MCP5", "shoulder=AC elbow=EL+EM wrist=RS+US hand=MCP2+MCP5"),
    "ISB, side before": ("RAC REL REM RRS RUS LAC LEL LEM LRS LUS", "shoulder=RAC elbow=REL+REM wrist=RRS+RUS"),
    "ISB, side behind": (
        "ACR_R EL_R EM_R RSP_R USP_R MC3_R",
        "shoulder=ACR_R elbow=EL_R+EM_R wrist=RSP_R+USP_R hand=MC3_R",
    ),
    "OpenSim": (
        "R.Shoulder R.Elbow R.Wrist L.Shoulder L.Elbow L.Wrist R.Biceps",
        "shoulder=R.Shoulder elbow=R.Elbow wrist=R.Wrist",
    ),
    "OpenSim, Rajagopal": ("RACR RLEL RMEL RFAradius RFAulna", "shoulder=RACR elbow=RLEL+RMEL wrist=RFAradius+RFAulna"),
    "Motive": ("Hip RShoulder RUArm RFArm RHand LShoulder LUArm LFArm LHand", "shoulder=RUArm elbow=RFArm wrist=RHand"),
    "Motive, subject and colon": (
        "giver:RUArm giver:RFArm giver:RHand",
        "shoulder=giver:RUArm elbow=giver:RFArm wrist=giver:RHand",
    ),
    "Motive, subject and line": (
        "giver_RUArm giver_RFArm giver_RHand",
        "shoulder=giver_RUArm elbow=giver_RFArm wrist=giver_RHand",
    ),
    "CMU": (
        "Hips RightShoulder RightArm RightForeArm RightHand RightFingerBase LeftArm LeftForeArm LeftHand",
        "shoulder=RightArm elbow=RightForeArm wrist=RightHand hand=RightFingerBase",
    ),
    "Mixamo": (
        "mixamorig:RightShoulder mixamorig:RightArm mixamorig:RightForeArm mixamorig:RightHand",
        "shoulder=mixamorig:RightArm elbow=mixamorig:RightForeArm wrist=mixamorig:RightHand",
    ),
    "Poser": ("rCollar rShldr rForeArm rHand", "shoulder=rShldr elbow=rForeArm wrist=rHand"),
    "Unreal": ("upperarm_r lowerarm_r hand_r hand_l", "shoulder=upperarm_r elbow=lowerarm_r wrist=hand_r"),
    "Xsens BVH": (
        "Hips Chest RightCollar RightShoulder RightElbow RightWrist LeftShoulder",
        "shoulder=RightShoulder elbow=RightElbow wrist=RightWrist",
    ),
    "SOMA": (
        "Hips Spine1 Chest RightShoulder RightArm RightForeArm RightHand RightHandThumb1 RightHandMiddle1 RightHandEnd",
        "shoulder=RightArm elbow=RightForeArm wrist=RightHand hand=RightHandMiddle1",
    ),
    "VRM": (
        "hips rightShoulder rightUpperArm rightLowerArm rightHand",
        "shoulder=rightUpperArm elbow=rightLowerArm wrist=rightHand",
    ),
    "VRoid": (
        "J_Bip_C_Hips J_Bip_R_UpperArm J_Bip_R_LowerArm J_Bip_R_Hand",
        "shoulder=J_Bip_R_UpperArm elbow=J_Bip_R_LowerArm wrist=J_Bip_R_Hand",
    ),
    "Biped": (
        "Bip01 Pelvis|Bip01 R Clavicle|Bip01 R UpperArm|Bip01 R Forearm|Bip01 R Hand",
        "shoulder=Bip01 R UpperArm elbow=Bip01 R Forearm wrist=Bip01 R Hand",
    ),
    "Daz": ("rShldrBend rForearmBend rHand", "shoulder=rShldrBend elbow=rForearmBend wrist=rHand"),
    "ARKit": (
        "right_shoulder_1_joint right_arm_joint right_forearm_joint right_hand_joint",
        "shoulder=right_arm_joint elbow=right_forearm_joint wrist=right_hand_joint",
    ),
    "DeepMotion": (
        "r_shoulder_JNT r_elbow_JNT r_wrist_JNT",
        "shoulder=r_shoulder_JNT elbow=r_elbow_JNT wrist=r_wrist_JNT",
    ),
    "MediaPipe": (
        "right_shoulder right_elbow right_wrist right_pinky right_index left_hip",
        "shoulder=right_shoulder elbow=right_elbow wrist=right_wrist hand=right_index+right_pinky",
    ),
    "Nuitrack": (
        "JOINT_RIGHT_SHOULDER JOINT_RIGHT_ELBOW JOINT_RIGHT_WRIST JOINT_RIGHT_HAND",
        "shoulder=JOINT_RIGHT_SHOULDER elbow=JOINT_RIGHT_ELBOW wrist=JOINT_RIGHT_WRIST hand=JOINT_RIGHT_HAND",
    ),
    "Theia": ("r_uarm r_larm r_hand l_uarm", "shoulder=r_uarm elbow=r_larm wrist=r_hand"),
    "side grown together": ("rshoulder relbow rhand lshoulder", "shoulder=rshoulder elbow=relbow hand=rhand"),
    "bones in full": (
        "AcromionR LateralEpicondyleR MedialEpicondyleR RadialStyloidR UlnarStyloidR AcromionL",
        "shoulder=AcromionR elbow=LateralEpicondyleR+MedialEpicondyleR wrist=RadialStyloidR+UlnarStyloidR",
    ),
    "bones abbreviated": (
        "SAJ_R HLE_R HME_R RSP_R USP_R",
        "shoulder=SAJ_R elbow=HLE_R+HME_R wrist=RSP_R+USP_R",
    ),
    "one wrist marker": ("S:RSHO S:RELB S:RWRA S:RFIN", "shoulder=S:RSHO elbow=S:RELB wrist=S:RWRA hand=S:RFIN"),
    "no wrist": ("shoulder elbow hand", "shoulder elbow hand"),
    "four bands": ("Shoulder UpperArm Forearm Hand Shoulder:Marker1", "Shoulder UpperArm Forearm Hand"),
    "words": ("shoulder elbow wrist hand", "shoulder elbow wrist hand"),
    "words, side behind": (
        "ShoulderRight ElbowRight WristRight HandRight ShoulderLeft",
        "shoulder=ShoulderRight elbow=ElbowRight wrist=WristRight hand=HandRight",
    ),
    "words, lines": (
        "right_shoulder right_elbow right_wrist",
        "shoulder=right_shoulder elbow=right_elbow wrist=right_wrist",
    ),
    "words, letters": (
        "R Shoulder|R Elbow Lat|R Elbow Med|R Wrist",
        "shoulder=R Shoulder elbow=R Elbow Lat+R Elbow Med wrist=R Wrist",
    ),
}


def points(names):
    return {name: np.ones((3, 3)) for name in names}


def split(text):
    return text.split("|") if "|" in text else text.split()


@pytest.mark.parametrize(("names", "arm"), SCHEMES.values(), ids=SCHEMES.keys())
def test_every_scheme_gives_its_right_arm(names, arm):
    guess = guess_arm(points(split(names)))
    assert guess.arm is not None
    assert guess.arm.side in {"right", ""}
    assert " ".join((guess.arm.base, *guess.arm.points)) == arm
    for text in (guess.arm.base, *guess.arm.points):
        parse(text, split(names), "here")
    assert str(guess.arm) in guess.sentence


@pytest.mark.parametrize("name", [name for name in SCHEMES if "Arm" not in name])
def test_the_order_of_the_points_does_not_matter(name):
    names = split(SCHEMES[name][0])
    one, other = guess_arm(points(names)).arm, guess_arm(points(names[::-1])).arm
    assert (one.side, one.scheme, {k: set(v) for k, v in one.roles.items()}) == (
        other.side,
        other.scheme,
        {k: set(v) for k, v in other.roles.items()},
    )


def test_the_other_side_is_said_and_can_be_preferred():
    both = points(split(SCHEMES["Plug-in Gait"][0]))
    assert "There is also the left arm (Plug-in Gait)" in guess_arm(both).sentence
    assert guess_arm(both, side="left").arm.base == "shoulder=LSHO"
    assert guess_arm(both, base="LSHO").arm.side == "left"
    assert guess_arm(points(["LSHO", "LELB", "LWRA", "LWRB"])).arm.side == "left"


def test_of_several_subjects_none_is_chosen():
    names = [f"{who}:{what}" for who in ("giver", "taker") for what in ("RUArm", "RFArm", "RHand")]
    guess = guess_arm(points([*names, "box:corner"]))
    assert guess.arm is None
    assert len(guess.arms) == 2
    assert guess.sentence == "Several subjects have an arm: 'giver', 'taker'"
    assert guess_arm(points(names), base="taker:RUArm").arm.subject == "taker"


def test_a_point_that_was_never_seen_is_no_part_of_an_arm():
    arm = points(["shoulder", "elbow", "wrist", "hand"])
    assert "hand" not in guess_arm(arm | {"hand": np.full((3, 3), np.nan)}).arm.roles
    assert guess_arm(arm | {"elbow": np.full((3, 3), np.nan)}).arm is None


@pytest.mark.parametrize(
    "names", [[], ["a", "b", "c"], ["RSHO", "RELB"], ["RASI", "RKNE", "RANK"], ["left hand", "right hand", "elbow pad"]]
)
def test_no_arm_no_guess(names):
    assert guess_arm(points(names)).arm is None
    assert find_arms(names) == []


@pytest.mark.parametrize(
    ("names", "oriented", "orientation"),
    [
        (SCHEMES["Vicon names"][0], [], "hand"),
        (SCHEMES["ISB"][0], [], None),
        (SCHEMES["Motive"][0], ["RHand", "RUArm"], "wrist"),
        (SCHEMES["CMU"][0], ["RightHand"], "wrist"),
        (SCHEMES["four bands"][0], ["Hand"], "Hand"),
        (SCHEMES["words"][0], [], None),
        (SCHEMES["words"][0], ["hand"], "hand"),
    ],
)
def test_the_hand_s_orientation(names, oriented, orientation):
    assert guess_arm(points(names.split())).arm.orientation(oriented) == orientation


def test_a_hand_that_lies_on_the_wrist_is_passed_over():
    names = ("RightArm", "RightForeArm", "RightHand", "RightFingerBase", "RFingers")
    places = dict(zip(names, np.eye(3)[[0, 1, 2, 2, 0]][:, None] * np.ones((4, 1)), strict=True))
    (arm,) = find_arms(places)
    assert arm.points[-1] == "hand=RFingers"
    (arm,) = find_arms({name: places[name] for name in names[:4]})
    assert "hand" not in arm.roles
