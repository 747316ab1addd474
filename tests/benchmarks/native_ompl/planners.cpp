// OMPL's own control planners on mazes, in C++ alone. Each line of the input is a run:
//     MAZE PLANNER MOST_STEPS CELL SEED TRANSITIONS SECONDS BLIND
// and is answered by: solved transitions seconds path_steps. Seconds are those of the thread's CPU in solve().
#include "maze.hpp"
#include <ctime>
#include <iostream>
#include <memory>
#include <ompl/base/goals/GoalRegion.h>
#include <ompl/base/spaces/RealVectorStateProjections.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/control/SimpleSetup.h>
#include <ompl/control/planners/est/EST.h>
#include <ompl/control/planners/kpiece/KPIECE1.h>
#include <ompl/control/planners/pdst/PDST.h>
#include <ompl/control/planners/rrt/RRT.h>
#include <ompl/control/planners/sst/SST.h>
#include <ompl/control/spaces/RealVectorControlSpace.h>
#include <ompl/util/RandomNumbers.h>

namespace ob = ompl::base;
namespace oc = ompl::control;
using State = ob::RealVectorStateSpace::StateType;
using Control = oc::RealVectorControlSpace::ControlType;

// The disc around the goal. It cannot be sampled, but KPIECE1 ranks cells by the distance to it, unless the disc is blind:
// then that is 1 everywhere outside. SST looks for better paths as long as it
// may, so the disc says when a state was in it.
class Disc : public ob::GoalRegion {
public:
    Disc(const ob::SpaceInformationPtr &si, const Maze &maze, bool &reached, bool blind)
        : ob::GoalRegion(si), maze(maze), reached(reached), blind(blind) {
        setThreshold(maze.goal_radius);
    }
    double distanceGoal(const ob::State *state) const override {
        const double *position = state->as<State>()->values;
        const double distance = maze.goal_distance(position[0], position[1]);
        reached = reached || distance < threshold_;
        return blind && distance >= threshold_ ? 1.0 : distance;
    }

private:
    const Maze &maze;
    bool &reached;
    bool blind;
};

static double cpu_seconds() {
    timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

static ob::PlannerPtr make_planner(const std::string &name, const oc::SpaceInformationPtr &si, bool blind) {
    if (name == "KPIECE1") {
        auto planner = std::make_shared<oc::KPIECE1>(si);
        if (blind)
            planner->setGoalBias(0.0); // this is about the motions nearest to the goal
        return planner;
    }
    if (name == "EST")
        return std::make_shared<oc::EST>(si);
    if (name == "RRT")
        return std::make_shared<oc::RRT>(si);
    if (name == "PDST")
        return std::make_shared<oc::PDST>(si);
    if (name == "SST")
        return std::make_shared<oc::SST>(si);
    throw std::runtime_error("unknown planner " + name);
}

static ob::StateSpacePtr make_space(const Maze &maze, double cell) {
    auto space = std::make_shared<ob::RealVectorStateSpace>(2);
    space->setBounds(0.0, maze.size);
    const std::vector<double> cells{cell, cell};
    const std::vector<unsigned int> axes{0, 1};
    auto projection = std::make_shared<ob::RealVectorOrthogonalProjectionEvaluator>(space, cells, axes);
    ob::RealVectorBounds bounds(2);
    bounds.setLow(0.0);
    bounds.setHigh(maze.size);
    projection->setBounds(bounds);
    space->registerDefaultProjection(projection);
    return space;
}

static void run(const Maze &maze, const std::string &name, int most_steps, double cell, long transitions, double limit,
                bool blind) {
    auto space = make_space(maze, cell);
    auto controls = std::make_shared<oc::RealVectorControlSpace>(space, 2);
    ob::RealVectorBounds box(2);
    box.setLow(-0.1);
    box.setHigh(0.1);
    controls->setBounds(box);
    oc::SimpleSetup setup(controls);
    long made = 0;
    setup.setStatePropagator([&](const ob::State *from, const oc::Control *control, double, ob::State *to) {
        made++;
        const double *action = control->as<Control>()->values, *position = from->as<State>()->values;
        double x = position[0], y = position[1];
        maze.step(x, y, action[0], action[1]);
        to->as<State>()->values[0] = x, to->as<State>()->values[1] = y;
    });
    auto si = setup.getSpaceInformation();
    si->setPropagationStepSize(1.0);
    si->setMinMaxControlDuration(1, most_steps);
    ob::ScopedState<ob::RealVectorStateSpace> start(space);
    start[0] = maze.start_x, start[1] = maze.start_y;
    setup.addStartState(start);
    bool reached = false;
    setup.setGoal(std::make_shared<Disc>(si, maze, reached, blind));
    setup.setPlanner(make_planner(name, si, blind));
    setup.setup();
    auto problem = setup.getProblemDefinition();
    const double began = cpu_seconds();
    unsigned polls = 0; // the clock costs as much as a few steps: it is looked at rarely
    setup.getPlanner()->solve(ob::PlannerTerminationCondition([&] {
        return made >= transitions || reached || (++polls % 256 == 0 && cpu_seconds() - began > limit);
    }));
    const double seconds = cpu_seconds() - began;
    const bool solved = problem->hasExactSolution();
    double steps = 0.0;
    if (solved)
        for (double duration : setup.getSolutionPath().getControlDurations())
            steps += duration;
    std::cout << solved << ' ' << made << ' ' << seconds << ' ' << long(steps) << std::endl;
}

int main() {
    ompl::msg::noOutputHandler();
    std::string path, name;
    int most_steps;
    unsigned long seed;
    double cell, limit;
    long transitions;
    bool blind;
    while (std::cin >> path >> name >> most_steps >> cell >> seed >> transitions >> limit >> blind) {
        ompl::RNG::setSeed(seed);
        run(Maze(path), name, most_steps, cell, transitions, limit, blind);
    }
}
