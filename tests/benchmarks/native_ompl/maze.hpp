// The mazes of pbcs_ompl with "stay" walls, from the file that bench.py writes: its step, wall by wall the same.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

class Maze {
public:
    double size, start_x, start_y, goal_x, goal_y, goal_radius;

    explicit Maze(const std::string &path) {
        std::FILE *file = std::fopen(path.c_str(), "rb");
        if (file == nullptr)
            throw std::runtime_error("cannot read " + path);
        double numbers[6];
        std::int64_t counts[3];
        read(file, numbers, 6);
        read(file, counts, 3);
        size = numbers[0], start_x = numbers[1], start_y = numbers[2];
        goal_x = numbers[3], goal_y = numbers[4], goal_radius = numbers[5];
        cells = counts[0];
        walls.resize(4 * counts[1]);
        lists.resize(counts[2]);
        read(file, walls.data(), walls.size());
        read(file, lists.data(), lists.size());
        std::fclose(file);
    }

    void step(double &x, double &y, double dx, double dy) const {
        const double x1 = x + dx, y1 = y + dy;
        const std::int64_t cell = cell_of(x) * cells + cell_of(y);
        for (std::int64_t k = lists[cell]; k < lists[cell + 1]; k++)
            if (hits(x, y, x1, y1, &walls[4 * lists[k]]))
                return;
        x = x1, y = y1;
    }

    double goal_distance(double x, double y) const { return std::hypot(x - goal_x, y - goal_y); }

private:
    static constexpr double rounding = 4e-16;
    std::int64_t cells;
    std::vector<double> walls;
    std::vector<std::int64_t> lists;

    template <typename Number> static void read(std::FILE *file, Number *numbers, std::size_t count) {
        if (std::fread(numbers, sizeof(Number), count, file) != count)
            throw std::runtime_error("the file of the maze is too short");
    }

    std::int64_t cell_of(double x) const {
        const double scaled = 5 * x;
        return !(scaled > 0) ? 0 : scaled >= double(cells) ? cells - 1 : std::int64_t(scaled);
    }

    static bool hits(double x0, double y0, double x1, double y1, const double *wall) {
        const double left = wall[0], bottom = wall[1], right = wall[2], top = wall[3];
        if (std::max(x0, x1) < left || std::min(x0, x1) > right || std::max(y0, y1) < bottom || std::min(y0, y1) > top)
            return false;
        const double dx = x1 - x0, dy = y1 - y0;
        const double high = dx > 0 ? top : bottom, low = dx > 0 ? bottom : top;
        const double near = dy > 0 ? left : right, far = dy > 0 ? right : left;
        double u = dx * (high - y0), v = dy * (near - x0);
        if (u - v < -rounding * (std::abs(u) + std::abs(v)))
            return false;
        u = dx * (low - y0), v = dy * (far - x0);
        return !(u - v > rounding * (std::abs(u) + std::abs(v)));
    }
};
