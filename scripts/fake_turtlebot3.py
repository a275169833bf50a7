#!/usr/bin/env python3
"""The simulated robot: it behaves like a TurtleBot3 with its firmware, on the same topics.

Subscribes
    cmd_vel       geometry_msgs/Twist          linear.x [m/s], angular.z [rad/s]
    reset         std_msgs/Empty               the firmware's reset (see simulation/simulator.py)
    motor_power   std_msgs/Bool                torque of the motors: on, off
Publishes (frames are in the node's namespace: robot3/odom in /robot3)
    imu           sensor_msgs/Imu              frame imu_link, ~imu_rate
    odom          nav_msgs/Odometry            odom -> base_footprint, ~odom_rate
    joint_states  sensor_msgs/JointState       with each odometry
    battery_state sensor_msgs/BatteryState     with each odometry
    sensor_state  turtlebot3_msgs/SensorState  with each odometry
    firmware_version   turtlebot3_msgs/VersionInfo, once a second
    /tf           tf2_msgs/TFMessage           odom -> base_footprint, with each odometry
    /tf_static    tf2_msgs/TFMessage           world -> odom: true place of the odometry's origin
    ground_truth  geometry_msgs/PoseStamped    frame world, 50 Hz: for tests, never for control
    /clock        rosgraph_msgs/Clock          with use_sim_time, 200 per simulated second
    The network (~network) delays imu, odom, joint_states and /tf. Messages of one topic that were
    delayed together are sent to each subscriber in one write.
Parameters
    ~speed        pace of /clock, times real time, with use_sim_time (1)
    ~robots       0: one robot, in this node's namespace; else the number of robots, in the
                  namespaces robot1, robot2, ..., 1 m apart along y (0)
    ~first_robot  number of the first robot (1)
    ~network      quiet, good, busy, bad: a set of network settings (simulation/network.py); a
                  setting that is given by its own name takes precedence (quiet)
    ~host         default, laptop, pi: the same for the computer that the robot's board is connected
                  to: rates, lags, stamps (simulation/simulator_config.py)
    ~mystery      1 to 9999: one hidden fault (simulation/mystery.py), the same for the same number.
                  There is no ground_truth, no /tf_static, and no setting that may change. Of
                  several robots, robot n hides the fault of number ~mystery + n - 1. 0: none (0)
    ~model        burger, waffle, waffle_pi (TURTLEBOT3_MODEL in the environment, else burger)
    all others    fields of SimulatorConfig (simulation/simulator_config.py), with unit, bounds and
                  default. All that are not in STARTING may change while it
                  runs, for all robots:
                  dynparam set /turtlebot3 network_cut true
"""
import tb3_labs.ros.early_ctrl_c    # noqa: F401 (first: Ctrl+C ends the imports below)

from dataclasses import dataclass, replace

import rospy

from tb3_labs.config import Config, setting
from tb3_labs.ros.node import read_config, read_model, run
from tb3_labs.ros.dynparam import LiveSettings
from tb3_labs.simulation.ros_board import UnsyncedRobot
from tb3_labs.simulation.ros_robot import FakeRobot, Pacemaker, StaticFrames
from tb3_labs.simulation.mystery import LAST, HiddenFault
from tb3_labs.simulation.network import NETWORKS
from tb3_labs.simulation.simulator_config import HOSTS, STARTING, SimulatorConfig

#: Distance between two robots, along y [m].
SPACING = 1.0


@dataclass(frozen=True)
class ClassConfig(Config):
    """Number of the robots, the pace of their time, and their network."""

    speed: float = setting(1.0, 'pace of /clock, times real time, with use_sim_time',
                           low=0.1, high=20.0)
    robots: int = setting(0, 'robots, in namespaces robot1, robot2, ...; 0: one in this namespace',
                          low=0, high=200)
    first_robot: int = setting(1, 'number of the first robot', low=1, high=10000)
    network: str = setting('quiet', 'named network between robots and computer',
                           choices=tuple(NETWORKS))
    host: str = setting('default', "named computer that the robots' boards are connected to",
                        choices=tuple(HOSTS))
    mystery: int = setting(0, 'number of a hidden fault to find by measuring; 0: none',
                           low=0, high=LAST)


class FakeTurtlebot3:
    """One robot, or several."""

    def __init__(self):
        settings, room = read_config(SimulatorConfig, ClassConfig)
        model = read_model().name
        if room.mystery:
            self._robots = _mystery_robots(replace(settings, model=model), room)
        else:
            settings = replace(_named(settings, NETWORKS[room.network], HOSTS[room.host]),
                               model=model)
            static_tf = StaticFrames()
            self._robots = [UnsyncedRobot(namespace) if own.firmware == 'ros2' else
                            FakeRobot(replace(own, seed=own.seed + number), namespace, static_tf)
                            for number, namespace, own in _placed(settings, room)]
            LiveSettings(settings, self._on_settings, fixed=STARTING)
        Pacemaker(self._robots, room.speed)

    def _on_settings(self, settings):
        for robot in self._robots:
            robot.configure(settings)


def _placed(settings, room):
    """Returns a list of (number, namespace, settings with the robot's place). A single robot has
    number 0, namespace '', and `settings` unchanged."""
    if not room.robots:
        return [(0, '', settings)]
    return [(number, 'robot%d' % number,
             replace(settings, start_y=settings.start_y + number * SPACING))
            for number in range(room.first_robot, room.first_robot + room.robots)]


def _mystery_robots(settings, room):
    """Returns robots with hidden faults. They publish no true pose, and offer no settings."""
    for name, plain in (('network', 'quiet'), ('host', 'default')):
        if getattr(room, name) != plain:
            raise ValueError('{0} = {1} is not valid together with mystery = {2}: the {0} may be '
                             'what is wrong with the robot'.format(
                                 name, getattr(room, name), room.mystery))
    robots = [
        FakeRobot(own, namespace, hidden=HiddenFault(room.mystery + max(number - 1, 0), own))
        for number, namespace, own in _placed(settings, room)]
    rospy.loginfo('mystery %d: one fault is hidden. There is no ground_truth, and no setting can '
                  'be changed while it runs.', room.mystery)
    return robots


def _named(settings, *sets):
    """Returns `settings` with the values of `sets`; a setting that is not the default stays."""
    plain = SimulatorConfig()
    return replace(settings, **{name: value for named in sets for name, value in named.items()
                                if getattr(settings, name) == getattr(plain, name)})


if __name__ == '__main__':
    run('turtlebot3', FakeTurtlebot3)
