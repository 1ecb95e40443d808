"""What the points of bodies stand for, in the order in which programs number them."""

from __future__ import annotations

from collections.abc import Mapping


def _words(text: str) -> tuple[str, ...]:
    """Names between blanks."""
    return tuple(text.split())


MEDIAPIPE = _words("""
    nose left_eye_inner left_eye left_eye_outer right_eye_inner right_eye right_eye_outer left_ear right_ear
    mouth_left mouth_right left_shoulder right_shoulder left_elbow right_elbow left_wrist right_wrist left_pinky
    right_pinky left_index right_index left_thumb right_thumb left_hip right_hip left_knee right_knee left_ankle
    right_ankle left_heel right_heel left_foot_index right_foot_index
""")
COCO = _words("""
    Nose LEye REye LEar REar LShoulder RShoulder LElbow RElbow LWrist RWrist LHip RHip LKnee RKnee LAnkle RAnkle
""")
HALPE = (*COCO, *_words("Head Neck Hip LBigToe RBigToe LSmallToe RSmallToe LHeel RHeel"))
BODY_25 = _words("""
    Nose Neck RShoulder RElbow RWrist LShoulder LElbow LWrist MidHip RHip RKnee RAnkle LHip LKnee LAnkle REye LEye
    REar LEar LBigToe LSmallToe LHeel RBigToe RSmallToe RHeel
""")
BODY_18 = _words("""
    Nose Neck RShoulder RElbow RWrist LShoulder LElbow LWrist RHip RKnee RAnkle LHip LKnee LAnkle REye LEye REar
    LEar
""")
HUMAN36M = _words("""
    Hip RHip RKnee RAnkle LHip LKnee LAnkle Spine Thorax Nose Head LShoulder LElbow LWrist RShoulder RElbow RWrist
""")
ZED_34 = _words("""
    PELVIS NAVAL_SPINE CHEST_SPINE NECK LEFT_CLAVICLE LEFT_SHOULDER LEFT_ELBOW LEFT_WRIST LEFT_HAND LEFT_HANDTIP
    LEFT_THUMB RIGHT_CLAVICLE RIGHT_SHOULDER RIGHT_ELBOW RIGHT_WRIST RIGHT_HAND RIGHT_HANDTIP RIGHT_THUMB LEFT_HIP
    LEFT_KNEE LEFT_ANKLE LEFT_FOOT RIGHT_HIP RIGHT_KNEE RIGHT_ANKLE RIGHT_FOOT HEAD NOSE LEFT_EYE LEFT_EAR
    RIGHT_EYE RIGHT_EAR LEFT_HEEL RIGHT_HEEL
""")
ZED_38 = _words("""
    PELVIS SPINE_1 SPINE_2 SPINE_3 NECK NOSE LEFT_EYE RIGHT_EYE LEFT_EAR RIGHT_EAR LEFT_CLAVICLE RIGHT_CLAVICLE
    LEFT_SHOULDER RIGHT_SHOULDER LEFT_ELBOW RIGHT_ELBOW LEFT_WRIST RIGHT_WRIST LEFT_HIP RIGHT_HIP LEFT_KNEE
    RIGHT_KNEE LEFT_ANKLE RIGHT_ANKLE LEFT_BIG_TOE RIGHT_BIG_TOE LEFT_SMALL_TOE RIGHT_SMALL_TOE LEFT_HEEL
    RIGHT_HEEL LEFT_HAND_THUMB_4 RIGHT_HAND_THUMB_4 LEFT_HAND_INDEX_1 RIGHT_HAND_INDEX_1 LEFT_HAND_MIDDLE_4
    RIGHT_HAND_MIDDLE_4 LEFT_HAND_PINKY_1 RIGHT_HAND_PINKY_1
""")
AZURE_KINECT = _words("""
    PELVIS SPINE_NAVEL SPINE_CHEST NECK CLAVICLE_LEFT SHOULDER_LEFT ELBOW_LEFT WRIST_LEFT HAND_LEFT HANDTIP_LEFT
    THUMB_LEFT CLAVICLE_RIGHT SHOULDER_RIGHT ELBOW_RIGHT WRIST_RIGHT HAND_RIGHT HANDTIP_RIGHT THUMB_RIGHT HIP_LEFT
    KNEE_LEFT ANKLE_LEFT FOOT_LEFT HIP_RIGHT KNEE_RIGHT ANKLE_RIGHT FOOT_RIGHT HEAD NOSE EYE_LEFT EAR_LEFT
    EYE_RIGHT EAR_RIGHT
""")
SMPL = _words("""
    pelvis left_hip right_hip spine1 left_knee right_knee spine2 left_ankle right_ankle spine3 left_foot right_foot
    neck left_collar right_collar head left_shoulder right_shoulder left_elbow right_elbow left_wrist right_wrist
""")
SMPL_24 = (*SMPL, "left_hand", "right_hand")
_FINGERS = tuple(f"{finger}{i}" for finger in ("index", "middle", "pinky", "ring", "thumb") for i in (1, 2, 3))
SMPL_H = (*SMPL, *(f"{side}_{finger}" for side in ("left", "right") for finger in _FINGERS))
SMPL_X = (*SMPL, "jaw", "left_eye_smplhf", "right_eye_smplhf", *SMPL_H[22:])
BY_COUNT: Mapping[int, tuple[str, ...]] = {
    18: BODY_18, 25: BODY_25, 26: HALPE, 33: MEDIAPIPE, 22: SMPL, 24: SMPL_24, 52: SMPL_H, 55: SMPL_X,
}  # fmt: skip
"""Number of points to their names, where it tells them."""
