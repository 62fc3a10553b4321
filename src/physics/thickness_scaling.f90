!> Mass scaling through the thickness as an effect: the last of the force stage.
module thickness_scaling
  use kinds, only: wp
  use patch_seams, only: collect, sum_groups, distribute
  use state_store, only: state_store_t, carry, carry_array
  use element, only: element_t
  use blank, only: assembly_t
  use thickness_masses, only: column_directions, column_differences, held_column_lag
  use effect, only: effect_t, instant_t
  implicit none
  private

  !> A column that supports hold in part.
  type, public :: held_column_t
    integer :: part = 0                         !! its patch
    integer :: at(2) = 0                        !! its place along axes 1 and 2
    logical, allocatable :: is_held(:, :)       !! components of its points, shape (n3, 3)
  end type held_column_t

  !> Adds to the forces what makes the lumped mass answer like the scaled one. These forces have no
  !! sum in any column and are no work: the kinetic energy of the scaled mass takes it up. At a seam
  !! each patch adds the part that it has of the mass there.
  type, extends(effect_t), public :: thickness_scaling_t
    type(held_column_t), allocatable :: held(:)
    !> Velocities of the points of these columns in the step before, one behind the other.
    real(wp), allocatable :: before(:)
    logical :: has_before = .false.
  contains
    procedure :: apply
    procedure :: carry => carry_thickness_scaling
    procedure, nopass :: rank => rank_of_scaling
  end type thickness_scaling_t

contains

  !> Last of all forces, for it weighs their sum.
  pure integer function rank_of_scaling() result(rank)
    rank = 1
  end function rank_of_scaling

  !> Forces -m (1 - 1/factor) times the difference of the acceleration, along the columns. None
  !! where forces balance.
  subroutine apply(self, bodies, instant)
    class(thickness_scaling_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp), allocatable :: acceleration(:, :, :, :), directions(:, :, :), lags(:, :, :)
    integer :: p, k, c

    if (instant%is_static) return
    associate (parts => bodies%blank%parts, seams => bodies%blank%seams)
      do p = 1, size(parts)
        associate (force => parts(p)%element%motion%external_force)
          call collect(seams, p, size(force)/3, 3, force)
        end associate
      end do
      call sum_groups(seams, 3)
      do p = 1, size(parts)
        associate (body => parts(p)%element, motion => parts(p)%element%motion)
          acceleration = motion%external_force
          call distribute(seams, p, size(body%mass), 3, acceleration)
          do c = 1, 3
            acceleration(:, :, :, c) = (acceleration(:, :, :, c) &
                                        - motion%internal_force(:, :, :, c))/body%inertia
          end do
          directions = column_directions(motion%x)
          lags = column_differences(body%inertia, directions, acceleration)
          do k = 1, size(body%mass, 3)
            lags(:, :, k) = lags(:, :, k)*(1.0_wp - 1.0_wp/body%column_factor)
          end do
          call set_held_lags(self, p, body, directions, instant%dt, acceleration, lags)
          do c = 1, 3
            do k = 1, size(body%mass, 3)
              motion%external_force(:, :, k, c) = motion%external_force(:, :, k, c) &
                                                  - directions(:, :, c)*body%mass(:, :, k) &
                                                    *lags(:, :, k)
            end do
          end do
        end associate
      end do
    end associate
    self%has_before = .true.
  end subroutine apply

  !> Columns of a patch that supports hold in part. What these hold moves on as it did in the step
  !! behind: the supports themselves have their say later.
  subroutine set_held_lags(self, part, body, directions, dt, acceleration, lags)
    class(thickness_scaling_t), intent(inout) :: self
    integer, intent(in) :: part
    class(element_t), intent(in) :: body
    real(wp), intent(in) :: directions(:, :, :), dt        !! see `column_directions`; last step
    real(wp), intent(inout) :: acceleration(:, :, :, :)    !! that forces give the lumped mass
    real(wp), intent(inout) :: lags(:, :, :)
    integer :: n, first, last

    last = 0
    do n = 1, size(self%held)
      associate (column => self%held(n), i => self%held(n)%at(1), j => self%held(n)%at(2))
        first = last + 1
        last = last + size(column%is_held)
        if (column%part /= part) cycle
        associate (v => body%motion%v(i, j, :, :), a => acceleration(i, j, :, :))
          where (column%is_held) a = 0.0_wp
          if (self%has_before .and. dt > 0.0_wp) then
            where (column%is_held) a = (v - reshape(self%before(first:last), shape(v)))/dt
          end if
          self%before(first:last) = reshape(v, [size(v)])
          lags(i, j, :) = held_column_lag(body%inertia(i, j, :), directions(i, j, :), &
                                          body%column_factor(i, j), column%is_held, a)
        end associate
      end associate
    end do
  end subroutine set_held_lags

  subroutine carry_thickness_scaling(self, store)
    class(thickness_scaling_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store

    if (size(self%held) == 0) return
    call carry(store, "has_before", self%has_before)
    call carry_array(store, "before", size(self%before), self%before)
  end subroutine carry_thickness_scaling

end module thickness_scaling
